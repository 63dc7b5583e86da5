// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows of a problem evaluated a chunk at a time: residuals and Jacobian, each number over its standard deviation.
#pragma once

#include <vector>

#include "fastcal/identification/problem.hpp"
#include "fastcal/model/row_block.hpp"

namespace fastcal {

/// Standard deviation of component c of row i: its own claim and the common noise, root of squares.
double whitening_deviation(const Problem& problem, const CommonNoise& tau, Eigen::Index i, int component);

/// One a thread; what it is given must outlive it. In a chunk the components lie apart: number n of row i is at
/// n * stride + i; where nothing was measured it is 0.
class WhitenedRows {
 public:
  WhitenedRows(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
               const Eigen::VectorXd& scale, const CommonNoise& tau);

  /// Residuals and weights before a loss of rows begin ... end - 1.
  void evaluate(Eigen::Index begin, Eigen::Index end);

  const RowWeight& weight(int i) const { return weights_[static_cast<std::size_t>(i)]; }

  /// Multiplies the numbers of row i once more.
  void weigh(int i, double factor) {
    for (std::size_t n = 0; n < numbers_.size(); ++n) at(factor_, n)[i] *= factor;
  }

  /// Residuals of row i as they are, NaN where not measured.
  template <typename Row>
  void raw(int i, Row out) const {
    for (std::size_t n = 0; n < numbers_.size(); ++n) {
      const auto k = static_cast<Eigen::Index>(n) * block_.stride() + i;
      if (factor_.data()[k] > 0) out[numbers_[n]] = residual_.data()[k];
    }
  }

  /// Rows and distance of columns of the block: [J r], one column after the other.
  int height() const { return static_cast<int>(numbers_.size()) * block_.stride(); }
  int ld() const { return height() + kernels::kGroup; }  // apart, so that columns do not meet in the cache

  /// (height, p + 1); stays until the next call.
  double* jacobian();

 private:
  double* at(AlignedNumbers& numbers, std::size_t n) {
    return numbers.data() + static_cast<Eigen::Index>(n) * block_.stride();
  }

  void compare(int i);

  /// d distance / d anchor is the opposite of its slope by the tool's position.
  void anchor_columns(double* J);

  void response_columns(double* J);

  const Problem& problem_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& scale_;
  CommonNoise tau_;
  RowBlock block_;
  Eigen::Matrix3Xd anchors_;
  std::vector<int> numbers_;  // components that are measured anywhere
  bool points_only_ = false;
  Eigen::VectorXd along_;  // y of the response to loads; empty where there is none
  Eigen::Index begin_ = 0;
  int rows_ = 0;
  RowResidual row_;
  std::vector<RowWeight> weights_;
  std::vector<int> anchor_;
  AlignedNumbers residual_, factor_, slope_;  // (numbers, stride): r, 1 / deviation or 0; (numbers, 6, stride)
  AlignedNumbers J_;
};

}  // namespace fastcal
