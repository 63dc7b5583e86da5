// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows of a problem evaluated a chunk at a time: residuals and Jacobian, each number over its standard deviation.
#pragma once

#include <vector>

#include "fastcal/identification/problem.hpp"
#include "fastcal/model/row_block.hpp"

namespace fastcal {

/// Standard deviation of a number of row i: its own claim and the common noise, root of squares.
double whitening_deviation(const Problem& problem, const CommonNoise& tau, Eigen::Index i, int number);

/// Rows worth evaluating at once where each holds so many numbers: a chunk, but of pictures as many as the second-level
/// cache holds.
Eigen::Index rows_at_once(int numbers);

/// The unknowns on which one number depends: two ranges of them, one behind the other in its derivatives.
struct OwnUnknowns {
  int first = 0, first_count = 0, second = 0, count = 0;  // count: of both

  bool operator==(const OwnUnknowns&) const = default;
  /// Of which the k-th derivative is.
  int unknown(int k) const { return k < first_count ? first + k : second + k - first_count; }
};

/// One a thread; what it is given must outlive it. In a chunk the components lie apart: number n of row i is at
/// n * stride + i; where nothing was measured it is 0.
class WhitenedRows {
 public:
  WhitenedRows(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
               const Eigen::VectorXd& scale, const CommonNoise& tau);

  /// Residuals and weights before a loss of rows begin ... end - 1.
  void evaluate(Eigen::Index begin, Eigen::Index end);

  const RowWeight& weight(int i) const { return weights_[i]; }

  /// Multiplies the numbers of row i once more.
  void weigh(int i, double factor) {
    for (int n = 0; n < count_; ++n) at(factor_, n)[i] *= factor;
  }

  /// Of row i, whose weight is w, -u dw/du = `slope`: what a robust loss takes from the curvature along the residual.
  void flatten(int i, double weight, double slope);
  bool is_flattened() const { return is_flattened_; }

  /// (height): whitened residuals times the weight that each row has by its number of components.
  Eigen::VectorXd weighted_residuals(const std::vector<const Loss*>& loss) const;

  /// (stride, p) by column at ld(), of the Jacobian `J` of weighted rows: a row whose square is what flatten() said.
  const double* along_residuals(const double* J);

  /// Residuals of row i as they are, NaN where not measured.
  template <typename Row>
  void raw(int i, Row out) const {
    for (int n = 0; n < count_; ++n) {
      if (is_measured(i, n)) out[n] = residual_.data()[place(i, n)];
    }
  }

  int number_count() const { return count_; }
  int stride() const { return static_cast<int>(block_.stride()); }
  /// Where number n of row i is in a column of the block.
  Eigen::Index place(int i, int n) const { return static_cast<Eigen::Index>(n) * block_.stride() + i; }
  bool is_measured(int i, int n) const { return factor_.data()[place(i, n)] > 0; }

  /// Rows and distance of columns of the block: [J r], one column after the other.
  int height() const { return count_ * block_.stride(); }
  int ld() const { return height() + kernels::kGroup; }  // apart, so that columns do not meet in the cache

  /// (height, p + 1); stays until the next call.
  double* jacobian();

  /// Numbers first ... end - 1 of every row, and the columns that are not zero in all of them; the last is r.
  struct Part {
    int first, end;
    std::vector<int> columns;
  };
  /// Of what jacobian() wrote. Corners of one camera have nothing in the columns of the others.
  std::vector<Part> parts() const;

 private:
  double* at(AlignedNumbers& numbers, int n) { return numbers.data() + static_cast<Eigen::Index>(n) * block_.stride(); }

  /// Points without claims of their own, all rows at once.
  bool compare_points();
  void compare(int i);
  void add(int i, int number, double r);
  void unknown_columns(double* J);
  void response_columns(double* J);

  const Problem& problem_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& scale_;
  CommonNoise tau_;
  RowBlock block_;
  Eigen::VectorXd unknowns_;
  int count_;                           // numbers of a row
  const RowMatrixXd* coordinates_;      // of the first observation, where it is the tool's position and needs no slopes
  std::vector<kernels::Sight> sights_;  // of the others, in the order of numbers and frames
  Eigen::VectorXd along_;               // y of the response to loads; empty where there is none
  Eigen::Index begin_ = 0;
  int rows_ = 0;
  Comparison comparison_;
  std::vector<double> inverse_;  // by number: of the common noise where no other is claimed, else 0
  std::vector<RowWeight> weights_;
  std::vector<int> column_of_;                // of each unknown; -1: it is not free
  std::vector<OwnUnknowns> own_;              // (numbers, stride)
  AlignedNumbers residual_, factor_, slope_;  // (numbers, stride): r, 1 / deviation or 0; (sights, 6, stride)
  AlignedNumbers by_unknown_;                 // (numbers, stride, kMostUnknowns), as many as own_ has
  AlignedNumbers change_;                     // (directions, numbers, stride): the loads' response, whitened
  AlignedNumbers J_;
  bool is_flattened_ = false;
  AlignedNumbers turn_, along_residuals_;  // (numbers, stride), by which J's rows are added up; what comes of it
};

}  // namespace fastcal
