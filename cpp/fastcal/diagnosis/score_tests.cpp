// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/diagnosis/score_tests.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

#include "fastcal/diagnosis/chi_square.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRank = 1e-9;  // of A, columns scaled to length 1
constexpr double kTwin = 1e-4;  // 1 - rho^2 below which what one block leaves of another is rounding and shape error

MatrixXd scaled(const Eigen::Ref<const MatrixXd>& X, VectorXd& length) {
  length = X.colwise().norm();
  return X * (length.array() > 0).select(length.array().inverse(), 0).matrix().asDiagonal();
}

constexpr double kSmallest = 1e-20;  // share of a signature in a block below which it counts as none
constexpr int kHalvings = 9;         // of 4 root of noncentrality: to 0.01
constexpr Index kColumns = 128;      // of a product that threads share: the same for any number of them

/// (rows, columns) of independent normal numbers.
MatrixXd standard_normal(Index rows, Index columns, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
}

/// [C r] projected by a QR of A.
ProjectedBlocks projected(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const MatrixXd>& C,
                          const Eigen::Ref<const VectorXd>& r) {
  const Index m = r.size();
  FASTCAL_CHECK(A.rows() == m && C.rows() == m)
      << "A, C and r must have as many rows, got " << A.rows() << ", " << C.rows() << " and " << m;
  FASTCAL_CHECK(A.allFinite() && C.allFinite() && r.allFinite()) << "A, C and r must be finite";
  ProjectedBlocks out;
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  if (A.cols() > 0) {  // Eigen's QR reads beyond a matrix without columns
    qr.compute(scaled(A, out.length));
    qr.setThreshold(kRank);
    out.null_rank = static_cast<int>(qr.rank());
  }
  const auto project = [&](const MatrixXd& X) {
    if (out.null_rank == 0) return X;
    return MatrixXd(reflected(qr, out.null_rank, X).bottomRows(m - out.null_rank));
  };
  out.r = project(r);
  out.R = project(scaled(C, out.length));
  return out;
}

}  // namespace

ScoreTests::ScoreTests(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const MatrixXd>& C,
                       const Eigen::Ref<const VectorXd>& r, const std::vector<int>& sizes, double least)
    : ScoreTests(projected(A, C, r), sizes, least) {}

ScoreTests::ScoreTests(ProjectedBlocks projected, const std::vector<int>& sizes, double least)
    : r_(std::move(projected.r)), null_rank_(projected.null_rank) {
  const MatrixXd& R = projected.R;
  const VectorXd& length = projected.length;
  FASTCAL_CHECK(R.rows() == r_.size() && length.size() == R.cols())
      << "R, r and length must fit together, got " << R.rows() << " by " << R.cols() << ", " << r_.size() << " and "
      << length.size();
  FASTCAL_CHECK(std::accumulate(sizes.begin(), sizes.end(), 0) == R.cols())
      << "the sizes of the blocks must add up to the " << R.cols() << " columns of C";
  for (const int size : sizes) FASTCAL_CHECK(size >= 1) << "a block has at least one column, got " << size;
  FASTCAL_CHECK(R.allFinite() && r_.allFinite() && length.allFinite()) << "R, r and length must be finite";

  length_ = R.colwise().norm().transpose().cwiseProduct(length);

  const auto count = static_cast<Index>(sizes.size());
  B_.resize(R.rows(), R.cols());
  first_.resize(count);
  scores_ = {Eigen::VectorXi::Zero(count), VectorXd::Zero(count)};
  surviving_ = VectorXd::Zero(count);
  estimate_ = VectorXd::Zero(R.cols());
  deviation_ = VectorXd::Constant(R.cols(), std::numeric_limits<double>::infinity());
  Index used = 0;
  Index column = 0;
  for (Index i = 0; i < count; ++i) {
    const Index size = sizes[static_cast<std::size_t>(i)];
    const auto block = R.middleCols(column, size);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(block.transpose() * block));
    const VectorXd& square = eigen.eigenvalues();
    first_[i] = static_cast<int>(used);
    int rank = 0;
    MatrixXd inverse = MatrixXd::Zero(size, size);  // V / sqrt(lambda) of what is kept
    for (Index k = size - 1; k >= 0 && square[k] > least * least; --k)
      inverse.col(rank++) = eigen.eigenvectors().col(k) / std::sqrt(square[k]);
    if (rank > 0) {
      B_.middleCols(used, rank).noalias() = block * inverse.leftCols(rank);
      const VectorXd along = B_.middleCols(used, rank).transpose() * r_;
      scores_.statistic[i] = along.squaredNorm();
      const VectorXd back = length.segment(column, size);
      estimate_.segment(column, size) =
          (back.array() > 0).select((inverse.leftCols(rank) * along).array() / back.array(), 0);
      if (rank == size)
        deviation_.segment(column, size) = inverse.rowwise().norm().array() / back.array();
      else  // a direction is absorbed: what has a share in it is not tested
        for (Index k = 0; k < size; ++k)
          if (eigen.eigenvectors().row(k).head(size - rank).norm() < 1e-6)
            deviation_[column + k] = inverse.row(k).norm() / back[k];
    }
    for (Index k = 0; k < size; ++k) {
      const VectorXd place = B_.middleCols(used, rank).transpose() * block.col(k);
      within_.push_back(place.norm() > least ? VectorXd(place.normalized()) : VectorXd());
      block_of_.push_back(static_cast<int>(i));
    }
    scores_.rank[i] = rank;
    const auto nonzero = static_cast<double>((length.segment(column, size).array() > 0).count());
    surviving_[i] = nonzero > 0 ? std::sqrt(block.squaredNorm() / nonzero) : 0;
    used += rank;
    column += size;
  }
  B_.conservativeResize(Eigen::NoChange, used);
  along_ = B_.transpose() * r_;
}

void ScoreTests::check(const std::vector<int>& blocks) const {
  for (const int i : blocks)
    FASTCAL_CHECK(i >= 0 && i < block_count()) << "there is no block " << i << "; there are " << block_count();
}

ScoreTests::Joined ScoreTests::joined(const std::vector<int>& added) const {
  check(added);
  Index total = 0;
  for (const int i : added) total += scores_.rank[i];
  MatrixXd with_all(total, B_.cols());
  MatrixXd with_each(total, total);
  VectorXd with_r(total);
  Index at = 0;
  {
    const std::lock_guard<std::mutex> lock(products_->mutex);
    for (const int i : added) {
      MatrixXd& known = products_->of_block[i];
      if (known.cols() != B_.cols()) known = basis(i).transpose() * B_;
      with_all.middleRows(at, scores_.rank[i]) = known;
      with_r.segment(at, scores_.rank[i]) = along_.segment(first_[i], scores_.rank[i]);
      at += scores_.rank[i];
    }
  }
  at = 0;
  for (const int i : added) {
    with_each.middleCols(at, scores_.rank[i]) = with_all.middleCols(first_[i], scores_.rank[i]);
    at += scores_.rank[i];
  }
  if (total == 0) return {with_all, with_r};
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(with_each);
  Index lost = 0;
  while (lost < total && eigen.eigenvalues()[lost] < kTwin) ++lost;
  const Index rank = total - lost;
  const MatrixXd back =
      eigen.eigenvectors().rightCols(rank) * eigen.eigenvalues().tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  return {back.transpose() * with_all, back.transpose() * with_r};
}

BlockScores ScoreTests::given(const std::vector<int>& added) const {
  const auto [X, t] = joined(added);
  const VectorXd z = along_ - X.transpose() * t;
  BlockScores out{Eigen::VectorXi::Zero(block_count()), VectorXd::Zero(block_count())};
  for (int k = 0; k < block_count(); ++k) {
    const Index size = scores_.rank[k];
    if (size == 0 || std::find(added.begin(), added.end(), k) != added.end()) continue;
    const auto part = X.middleCols(first_[k], size);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        MatrixXd(MatrixXd::Identity(size, size) - part.transpose() * part));
    const VectorXd along = eigen.eigenvectors().transpose() * z.segment(first_[k], size);
    for (Index d = size - 1; d >= 0 && eigen.eigenvalues()[d] > kTwin; --d) {
      ++out.rank[k];
      out.statistic[k] += along[d] * along[d] / eigen.eigenvalues()[d];
    }
  }
  return out;
}

double ScoreTests::remaining_with(const std::vector<int>& added, int& rank) const {
  const auto [X, t] = joined(added);
  rank = static_cast<int>(t.size());
  return remaining() - t.squaredNorm();
}

MatrixXd ScoreTests::correlation(const std::vector<int>& of, const std::vector<int>& with) const {
  check(of);
  check(with);
  MatrixXd out = MatrixXd::Zero(static_cast<Index>(of.size()), static_cast<Index>(with.size()));
  for (Index a = 0; a < out.rows(); ++a)
    for (Index b = 0; b < out.cols(); ++b) {
      const int i = of[static_cast<std::size_t>(a)];
      const int k = with[static_cast<std::size_t>(b)];
      if (scores_.rank[i] == 0 || scores_.rank[k] == 0) continue;
      const MatrixXd cosines = basis(i).transpose() * basis(k);
      out(a, b) = std::min(1.0, Eigen::JacobiSVD<MatrixXd>(cosines).singularValues()[0]);
    }
  return out;
}

MatrixXd ScoreTests::shared(const std::vector<int>& of, const std::vector<int>& with) const {
  check(of);
  check(with);
  MatrixXd out = MatrixXd::Zero(static_cast<Index>(of.size()), static_cast<Index>(with.size()));
  for (Index a = 0; a < out.rows(); ++a) {
    const int i = of[static_cast<std::size_t>(a)];
    if (scores_.rank[i] == 0 || scores_.statistic[i] <= 0) continue;
    const VectorXd signature = basis(i) * (basis(i).transpose() * r_);
    for (Index b = 0; b < out.cols(); ++b) {
      const int k = with[static_cast<std::size_t>(b)];
      if (scores_.rank[k] > 0) out(a, b) = (basis(k).transpose() * signature).squaredNorm() / signature.squaredNorm();
    }
  }
  return out;
}

MatrixXd ScoreTests::along_all(const MatrixXd& X, int threads) const {
  MatrixXd out(X.cols(), B_.cols());
  const auto nothing = [] { return 0; };
  parallel_units((B_.cols() + kColumns - 1) / kColumns, threads, nothing, [&](int, Index unit) {
    const Index first = unit * kColumns;
    const Index count = std::min(kColumns, B_.cols() - first);
    out.middleCols(first, count).noalias() = X.transpose() * B_.middleCols(first, count);
  });
  return out;
}

VectorXd ScoreTests::detectable(const std::vector<int>& columns, const VectorXd& limits, double power, int draws,
                                std::uint64_t seed, int threads) const {
  FASTCAL_CHECK(limits.size() == block_count())
      << "limits must hold " << block_count() << " numbers, got " << limits.size();
  FASTCAL_CHECK(power > 0 && power < 1 && draws >= 1)
      << "power must lie between 0 and 1 and draws be at least 1, got " << power << " and " << draws;
  const MatrixXd noise = along_all(standard_normal(B_.rows(), draws, seed), threads);  // (draws, used)
  MatrixXd square(draws, block_count());
  for (int k = 0; k < block_count(); ++k)
    square.col(k) = noise.middleCols(first_[k], scores_.rank[k]).rowwise().squaredNorm();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  VectorXd out = VectorXd::Constant(static_cast<Index>(columns.size()), kInfinity);
  MatrixXd shape = MatrixXd::Zero(B_.rows(), static_cast<Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    FASTCAL_CHECK(columns[c] >= 0 && columns[c] < static_cast<int>(within_.size()))
        << "there is no column " << columns[c];
    const auto column = static_cast<std::size_t>(columns[c]);
    if (within_[column].size() > 0) shape.col(static_cast<Index>(c)) = basis(block_of_[column]) * within_[column];
  }
  const MatrixXd signatures = along_all(shape, threads);  // (columns, used)
  const ArrayXd loudest = square.colwise().maxCoeff().cwiseSqrt();
  const auto order_of_blocks = [&] { return std::vector<int>(static_cast<std::size_t>(block_count())); };
  parallel_units(out.size(), threads, order_of_blocks, [&](std::vector<int>& order, Index c) {
    if (within_[static_cast<std::size_t>(columns[static_cast<std::size_t>(c)])].size() == 0) return;
    const VectorXd signature = signatures.row(c);
    VectorXd share(block_count());
    for (int k = 0; k < block_count(); ++k) share[k] = signature.segment(first_[k], scores_.rank[k]).norm();
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return share[a] > share[b]; });
    // |n + root s|^2 <= limit holds for the roots of an interval, in all blocks for those of their intersection.
    ArrayXd from = ArrayXd::Constant(draws, -kInfinity);
    ArrayXd to = ArrayXd::Constant(draws, kInfinity);
    const auto detected = [&] {
      const auto seen = [&](double root) {
        return static_cast<double>((root < from || root > to).count()) >= power * draws;
      };
      double low = 0;
      double high = 4;
      while (!seen(high)) high *= 2;
      for (int step = 0; step < kHalvings; ++step) {
        const double middle = (low + high) / 2;
        (seen(middle) ? high : low) = middle;
      }
      return std::make_pair(low, high);
    };
    double most = kInfinity;  // the blocks so far detect this root
    for (const int k : order) {
      const Index size = scores_.rank[k];
      if (size == 0 || std::isinf(limits[k])) continue;
      // |n| + root |s| stays below the limit as far as the root matters.
      if (loudest[k] + most * share[k] <= std::sqrt(limits[k])) continue;
      const double s2 = std::max(share[k] * share[k], kSmallest);
      const auto own = signature.segment(first_[k], size);
      const ArrayXd middle = -(noise.middleCols(first_[k], size) * own).array() / s2;
      const ArrayXd half = middle.square() - (square.col(k).array() - limits[k]) / s2;
      const ArrayXd root = half.max(0).sqrt();
      from = from.max((half < 0).select(kInfinity, middle - root));
      to = to.min((half < 0).select(-kInfinity, middle + root));
      if (std::isinf(most)) most = detected().second;
    }
    const auto [low, high] = detected();
    out[c] = (low + high) / 2;
  });
  return out;
}

}  // namespace fastcal
