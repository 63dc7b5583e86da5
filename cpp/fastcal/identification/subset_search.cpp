// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/subset_search.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

constexpr double kSameSpan = 1e-9;  // of a column's norm: what the kept columns leave of one in their span is rounding
constexpr double kGramNoise = 1e-11;  // of a column's squared norm: as little is rounding of a Gram matrix

/// Orthonormal columns that span `A`, as many as its rank.
Eigen::MatrixXd basis(const Eigen::MatrixXd& A) {
  if (A.cols() == 0 || A.rows() == 0) return {A.rows(), 0};
  Eigen::MatrixXd scaled = A;  // units must not decide what has a rank
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    const double norm = A.col(j).norm();
    if (norm > 0) scaled.col(j) /= norm;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  qr.setThreshold(kSameSpan);
  return q_columns(qr, qr.rank());
}

/// Mean and its standard error from the sums that come fold by fold (B. Welford, Technometrics 4, 1962).
class Average {
 public:
  explicit Average(Eigen::Index sets) : mean_(Eigen::VectorXd::Zero(sets)), spread_(Eigen::VectorXd::Zero(sets)) {}

  void add(Eigen::Index set, double value, double fold) {
    const double step = value - mean_[set];
    mean_[set] += step / fold;
    spread_[set] += step * (value - mean_[set]);
  }

  FoldErrors result(double folds) const { return {mean_, (spread_ / (folds * (folds - 1))).cwiseSqrt()}; }

 private:
  Eigen::VectorXd mean_, spread_;
};

}  // namespace

SubsetSearch::SubsetSearch(const Eigen::Ref<const RowMatrixXd>& kept, const Eigen::Ref<const RowMatrixXd>& optional,
                           const Eigen::Ref<const Eigen::VectorXd>& r, const Eigen::Ref<const Eigen::VectorXi>& fold,
                           double least_norm)
    : least_square_(static_cast<std::size_t>(optional.cols())) {
  const Eigen::Index n = r.size();
  const Eigen::Index m = optional.cols();
  FASTCAL_CHECK(kept.rows() == n && optional.rows() == n && fold.size() == n)
      << "kept, optional, r and fold must have as many rows, got " << kept.rows() << ", " << optional.rows() << ", "
      << n << " and " << fold.size();
  FASTCAL_CHECK(kept.allFinite() && optional.allFinite() && r.allFinite()) << "kept, optional and r must be finite";
  FASTCAL_CHECK(least_norm >= 0) << "least_norm must be at least 0, got " << least_norm;
  FASTCAL_CHECK(n > 0 && fold.minCoeff() >= -1 && fold.maxCoeff() >= 1)
      << "fold must hold -1 ... K - 1, and there must be two folds or more";
  const Eigen::Index folds = fold.maxCoeff() + 1;
  std::vector<Eigen::Index> counts(static_cast<std::size_t>(folds + 1), 0);  // the last: rows that are always fitted
  const auto place = [&](Eigen::Index i) { return static_cast<std::size_t>(fold[i] < 0 ? folds : fold[i]); };
  for (Eigen::Index i = 0; i < n; ++i) ++counts[place(i)];
  for (std::size_t k = 0; k + 1 < counts.size(); ++k) FASTCAL_CHECK(counts[k] > 0) << "fold " << k << " has no rows";

  // The kept columns as an orthonormal basis, and the others without what lies in it: the same sets of predictions, and
  // Gram matrices that are as well conditioned as the kept columns allow.
  const Eigen::MatrixXd Q = basis(kept);
  const Eigen::Index c = Q.cols();
  Eigen::MatrixXd A(n, c + m + 1);
  A << Q, optional, r;
  auto others = A.rightCols(m + 1);
  for (int pass = 0; pass < 2; ++pass) others -= Q * (Q.transpose() * others);
  for (Eigen::Index j = 0; j < m; ++j) {
    if (others.col(j).norm() <= kSameSpan * optional.col(j).norm()) others.col(j).setZero();
    least_square_[static_cast<std::size_t>(j)] =
        std::max(kGramNoise * others.col(j).squaredNorm(), least_norm * least_norm);
  }

  std::vector<Eigen::MatrixXd> grams(counts.size(), Eigen::MatrixXd::Zero(c + m + 1, c + m + 1));
  for (std::size_t k = 0; k < grams.size(); ++k) {
    if (counts[k] == 0) continue;  // no row is always fitted; Eigen divides by the depth of a large product
    Eigen::MatrixXd block(counts[k], A.cols());
    Eigen::Index at = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (place(i) == k) block.row(at++) = A.row(i);
    }
    grams[k].selfadjointView<Eigen::Upper>().rankUpdate(block.transpose());
  }
  for (std::size_t k = 0; k + 1 < grams.size(); ++k) {
    Fold all{Eigen::MatrixXd::Zero(c + m + 1, c + m + 1), grams[k], static_cast<double>(counts[k])};
    for (std::size_t other = 0; other < grams.size(); ++other) {
      if (other != k) all.M += grams[other];  // a sum, not the whole less this fold, which would cancel
    }
    for (Eigen::Index j = 0; j < c; ++j) {
      if (all.M(j, j) > kGramNoise) eliminate(all, j, all);
    }
    folds_.push_back({all.M.bottomRightCorner(m + 1, m + 1), all.H.bottomRightCorner(m + 1, m + 1), all.count});
  }
}

void SubsetSearch::eliminate(const Fold& from, Eigen::Index j, Fold& to) {
  const double inverse = 1 / from.M(j, j);
  const double own = from.H(j, j);
  for (Eigen::Index b = j + 1; b < from.M.cols(); ++b) {
    const double m = from.M(j, b);
    const double t = m * inverse;
    const double h = from.H(j, b) - t * own;
    for (Eigen::Index a = j + 1; a <= b; ++a) {
      const double s = from.M(j, a) * inverse;
      to.M(a, b) = from.M(a, b) - s * m;
      to.H(a, b) = from.H(a, b) - s * h - t * from.H(j, a);
    }
  }
}

void SubsetSearch::walk(const Fold& at, int j, std::size_t set, std::vector<Fold>& levels,
                        std::vector<double>& errors) const {
  const int m = optional_count();
  if (j == m) {
    errors[set] = std::max(0.0, at.H(m, m));
    return;
  }
  walk(at, j + 1, set, levels, errors);
  const std::size_t with = set | (std::size_t{1} << j);
  if (at.M(j, j) <= least_square_[static_cast<std::size_t>(j)]) {
    walk(at, j + 1, with, levels, errors);
    return;
  }
  Fold& next = levels[static_cast<std::size_t>(j)];  // free: walks of columns behind j use levels behind it
  eliminate(at, j, next);
  walk(next, j + 1, with, levels, errors);
}

FoldErrors SubsetSearch::all() const {
  const int m = optional_count();
  FASTCAL_CHECK(m <= kMostOptional) << "all subsets are searched of at most " << kMostOptional << " columns, got " << m;
  std::vector<double> errors(std::size_t{1} << m);
  std::vector<Fold> levels(static_cast<std::size_t>(m),
                           Fold{Eigen::MatrixXd(m + 1, m + 1), Eigen::MatrixXd(m + 1, m + 1)});
  Average average(static_cast<Eigen::Index>(errors.size()));
  for (std::size_t k = 0; k < folds_.size(); ++k) {
    walk(folds_[k], 0, 0, levels, errors);
    for (std::size_t set = 0; set < errors.size(); ++set) {
      average.add(static_cast<Eigen::Index>(set), errors[set] / folds_[k].count, static_cast<double>(k + 1));
    }
  }
  return average.result(fold_count());
}

FoldErrors SubsetSearch::of(
    const Eigen::Ref<const Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>& sets) const {
  const int m = optional_count();
  FASTCAL_CHECK(sets.cols() == m) << "sets must have " << m << " columns, got " << sets.cols();
  Average average(sets.rows());
  for (Eigen::Index set = 0; set < sets.rows(); ++set) {
    std::vector<int> columns;
    for (int j = 0; j < m; ++j) {
      if (sets(set, j)) columns.push_back(j);
    }
    const auto count = static_cast<Eigen::Index>(columns.size());
    columns.push_back(m);
    for (std::size_t k = 0; k < folds_.size(); ++k) {
      Fold fold{folds_[k].M(columns, columns), folds_[k].H(columns, columns), folds_[k].count};
      for (Eigen::Index j = 0; j < count; ++j) {
        if (fold.M(j, j) > least_square_[static_cast<std::size_t>(columns[static_cast<std::size_t>(j)])])
          eliminate(fold, j, fold);
      }
      average.add(set, std::max(0.0, fold.H(count, count)) / fold.count, static_cast<double>(k + 1));
    }
  }
  return average.result(fold_count());
}

}  // namespace fastcal
