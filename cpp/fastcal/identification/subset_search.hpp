// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// K-fold cross-validated error of every subset of the columns of a linear least-squares problem, exactly:
//   EV(A) = 1/K sum_k MSE_k,  MSE_k = |r_k - J_k b|^2 / n_k,  b = argmin |r - J b| over the rows of the other folds, b
//   = 0 outside A
// (X. Chen, Q. Zhang, Y. Sun 2020, equations 4 and 5).  Coefficients never appear.  With M the Gram matrix of [J r]
// over the rows that are fitted and H the one over the rows held out, putting column j into the set turns every column
// x into what j leaves of it,
//   x <- x - t_x x_j,  t_x = M_jx / M_jj,  a congruence of both M and H,  after which H_rr is the squared error held
//   out.
// Only columns behind j need it, so in a walk over the tree of subsets the costs of a set average to a dozen numbers,
// whatever their count (the ordering is that of G. Furnival, R. Wilson, "Regressions by leaps and bounds",
// Technometrics 16, 1974).
#pragma once

#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// EV of each set and the standard error of that mean over the folds.
struct FoldErrors {
  Eigen::VectorXd mean, standard_error;
};

/// A problem in folds: its normal matrices are formed once and shared by all sets.
class SubsetSearch {
 public:
  static constexpr int kMostOptional = 24;  ///< of all(): 2^24 sets are 256 MB

  /// `kept` (n, c): columns of every set; `optional` (n, m); `r` (n): what is fitted, J b ~ r; `fold` (n): 0 ... K - 1,
  /// or -1 for a row that is always fitted and never held out (a prior).
  /// A column that the fitted rows hardly separate from those before it (its remaining norm is below `least_norm`, or
  /// rounding) has the coefficient 0 and changes nothing. Throws InvalidInput where sizes differ, a fold is empty, or a
  /// number is not finite.
  SubsetSearch(const Eigen::Ref<const RowMatrixXd>& kept, const Eigen::Ref<const RowMatrixXd>& optional,
               const Eigen::Ref<const Eigen::VectorXd>& r, const Eigen::Ref<const Eigen::VectorXi>& fold,
               double least_norm = 0);

  int optional_count() const { return static_cast<int>(least_square_.size()); }
  int fold_count() const { return static_cast<int>(folds_.size()); }

  /// All 2^m sets; bit j of a set's index: column j is in it.
  FoldErrors all() const;

  /// The given sets, (S, m) rows of 0 and 1.
  FoldErrors of(
      const Eigen::Ref<const Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>& sets) const;

 private:
  /// Gram matrices of [optional r], kept columns eliminated: of the rows that are fitted and of those held out. Upper
  /// triangles.
  struct Fold {
    Eigen::MatrixXd M, H;
    double count = 0;  ///< rows held out
  };

  /// Puts column j of `from` into the set; the columns behind it come out in `to`, which may be `from`.
  static void eliminate(const Fold& from, Eigen::Index j, Fold& to);
  /// Walks the subsets of the columns j ... m - 1, on top of those in `set`, whose matrices are `at`.
  void walk(const Fold& at, int j, std::size_t set, std::vector<Fold>& levels, std::vector<double>& errors) const;

  std::vector<Fold> folds_;
  std::vector<double> least_square_;  // (m) a column with less left has the coefficient 0
};

}  // namespace fastcal
