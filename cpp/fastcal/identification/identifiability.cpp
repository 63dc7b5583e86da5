// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identifiability.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/normal_sums.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {

namespace {

/// What R does nothing to, and how many of its directions do anything at all.
struct NullSpace {
  int rank = 0;
  Eigen::MatrixXd basis;  // (p, lost), orthonormal
};

/// A bound from below, for the first `rank` columns of the pivoted R; nothing where the others do something, or some
/// direction of these so little that it might count as nothing.
std::optional<double> least_singular_value_bound(const Eigen::MatrixXd& R, Eigen::Index rank,
                                                 const GaugeOptions& options) {
  constexpr double kClearly = 100;
  const Eigen::Index lost = R.cols() - rank;
  if (rank == 0 || (options.off && lost > 0) || !R.allFinite()) return {};
  const double least = R.colwise().norm().maxCoeff();  // that the largest singular value can be
  const double most = R.norm();
  const double smallest = 1 / inverse_of_lower(R.topLeftCorner(rank, rank).transpose()).norm();
  if (!(smallest >= kClearly * options.relative_tolerance * most)) return {};
  if (!(kClearly * R.bottomRightCorner(lost, lost).norm() <= options.relative_tolerance * least)) return {};
  return smallest;
}

/// M with rows of zeros beneath it, as many as the kernels ask for.
Eigen::MatrixXd padded(const Eigen::MatrixXd& M) {
  const Eigen::Index height = (M.rows() + kernels::kGroup - 1) / kernels::kGroup * kernels::kGroup;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(height, M.cols());
  out.topRows(M.rows()) = M;
  return out;
}

/// Columns in the order in which Cholesky's factorization of A with full pivoting takes them (N. Higham, "Accuracy and
/// Stability of Numerical Algorithms" 2002, 10.3).
std::vector<int> pivots(const Eigen::MatrixXd& A) {
  const Eigen::Index p = A.cols();
  std::vector<int> order(static_cast<std::size_t>(p));
  std::iota(order.begin(), order.end(), 0);
  Eigen::MatrixXd L(p, p);  // rows in the order of A
  Eigen::VectorXd left = A.diagonal();
  for (Eigen::Index k = 0; k < p; ++k) {
    const auto largest =
        std::max_element(order.begin() + k, order.end(), [&](int a, int b) { return left[a] < left[b]; });
    std::iter_swap(order.begin() + k, largest);
    const int pivot = order[static_cast<std::size_t>(k)];
    if (!(left[pivot] > 0)) break;
    L.col(k) = A.col(pivot);
    L.col(k).noalias() -= L.leftCols(k) * L.row(pivot).head(k).transpose();
    L.col(k) /= std::sqrt(left[pivot]);
    left -= L.col(k).cwiseAbs2();
  }
  return order;
}

/// An orthonormal basis (p, p - rank) of what [R1 R2], R1 (rank, rank) upper triangular, does nothing to.
Eigen::MatrixXd nulled(const Eigen::MatrixXd& R12) {
  const Eigen::Index rank = R12.rows();
  const Eigen::Index lost = R12.cols() - rank;
  Eigen::MatrixXd null(R12.cols(), lost);
  null << -solve_upper(R12.leftCols(rank), R12.rightCols(lost)), Eigen::MatrixXd::Identity(lost, lost);
  return q_columns(Eigen::HouseholderQR<Eigen::MatrixXd>(null), lost);
}

/// The directions that [R1 R2] (rank, p), whose singular values are all clearly there, shows less than the practical
/// limit asks, and after them all those that it does nothing to; orthonormal.
///
/// [R1 R2] = T Z^T, so that T^-1 T^-T has the inverse squares of its singular values: the weak ones are the largest
/// there, and the most exact.
Eigen::MatrixXd hardly_shown(const Eigen::MatrixXd& R12, const GaugeOptions& options) {
  const Eigen::Index rank = R12.rows();
  const Eigen::Index p = R12.cols();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(R12.transpose());
  const Eigen::MatrixXd Z = q_columns(qr, p);
  const Eigen::MatrixXd back = inverse_of_lower(qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>().transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> inverse(Eigen::MatrixXd(back * back.transpose()));
  const auto weak = (inverse.eigenvalues().array() > options.practical_limit * options.practical_limit).count();
  Eigen::MatrixXd out(p, p - rank + weak);
  out << Z.leftCols(rank) * inverse.eigenvectors().rightCols(weak), Z.rightCols(p - rank);
  return out;
}

/// QR with column pivoting, M P = Q [R1 R2; 0 R3], at a tenth of the price of an SVD: the pivots are those of
/// Cholesky's factorization of M^T M, which loses sight of small ones; where this matters, least_singular_value_bound()
/// says nothing. Nothing where it leaves any doubt of what the singular values would say.
std::optional<NullSpace> clear_null_space(const Eigen::MatrixXd& M, const GaugeOptions& options) {
  if (!M.allFinite()) return {};
  const auto p = static_cast<int>(M.cols());
  Eigen::MatrixXd rows = padded(M);
  const auto height = static_cast<int>(rows.rows());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(p, p);
  kernels::add_gram(rows.data(), height, height, p, A.data());
  A.triangularView<Eigen::StrictlyLower>() = A.transpose();
  const std::vector<int> order = pivots(A);
  rows = rows(Eigen::all, order).eval();
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(p, p);
  kernels::update_triangle(rows.data(), height, height, p, R.data());
  const Eigen::Index rank = (R.diagonal().cwiseAbs().array() > options.relative_tolerance * R.norm()).count();
  const std::optional<double> smallest = least_singular_value_bound(R, rank, options);
  if (!smallest) return {};
  const bool all_clear = options.off || *smallest * options.practical_limit >= 1;
  if (all_clear && rank == p) return NullSpace{p, Eigen::MatrixXd(p, 0)};
  const Eigen::MatrixXd R12 = R.topRows(rank).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd pivoted = all_clear ? nulled(R12) : hardly_shown(R12, options);
  Eigen::MatrixXd null(p, pivoted.cols());
  null(order, Eigen::all) = pivoted;
  return NullSpace{static_cast<int>(rank), null};
}

NullSpace null_space(const Eigen::MatrixXd& R, const GaugeOptions& options) {
  const Eigen::Index p = R.cols();
  const RightSvd svd = right_svd(R);
  NullSpace out;
  Eigen::Index kept = 0;
  for (Eigen::Index k = 0; k < p; ++k) {
    const double s = svd.values[k];
    if (s > options.relative_tolerance * svd.values[0] && s > 0) {
      ++out.rank;
      if (s * options.practical_limit >= 1) ++kept;
    }
  }
  if (options.off) {
    FASTCAL_CHECK(svd.values[p - 1] > 0) << "without a gauge every parameter needs data or a prior";
    kept = p;
  }
  out.basis = svd.V.rightCols(p - kept);
  return out;
}

/// A held parameter and a free one that the smallest error of the first moves far; nothing where there is none, or it
/// is one of which nothing is known to hold it at, as the place of the base.
std::optional<std::pair<int, int>> runaway(const Gauge& gauge, const Eigen::VectorXd& hold) {
  constexpr double kRunsAway = 100;  // plausible sizes by one of the held parameter
  constexpr double kKnown = 1e-4;    // fixing_priority()
  for (std::size_t k = 0; k < gauge.held.size(); ++k) {
    for (const int j : gauge.free) {
      if (hold[j] > kKnown && std::abs(gauge.directions(j, static_cast<Eigen::Index>(k))) > kRunsAway)
        return std::pair(gauge.held[k], j);
    }
  }
  return {};
}

}  // namespace

bool parts_clearly(const Eigen::MatrixXd& R, Eigen::Index rank, const GaugeOptions& options) {
  const std::optional<double> smallest = least_singular_value_bound(R, rank, options);
  return smallest && *smallest * options.practical_limit >= 1;
}

Gauge choose_gauge(const Eigen::MatrixXd& R, const Eigen::VectorXd& hold, const GaugeOptions& options) {
  const Eigen::Index p = R.cols();
  Gauge gauge;
  if (p == 0) return gauge;
  const std::optional<NullSpace> clear = clear_null_space(R, options);
  const NullSpace space = clear ? *clear : null_space(R, options);
  const Eigen::MatrixXd& null = space.basis;
  const Eigen::Index lost = null.cols();
  gauge.rank = space.rank;
  std::vector<bool> is_held(static_cast<std::size_t>(p), false);
  if (lost > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr((hold.asDiagonal() * null).transpose());
    for (Eigen::Index k = 0; k < lost; ++k) is_held[static_cast<std::size_t>(qr.colsPermutation().indices()[k])] = true;
  }
  const auto part = [&] {
    gauge.held.clear();
    gauge.free.clear();
    for (int k = 0; k < p; ++k) (is_held[static_cast<std::size_t>(k)] ? gauge.held : gauge.free).push_back(k);
    gauge.directions = lost > 0 ? divided(null, null(gauge.held, Eigen::all)) : Eigen::MatrixXd(p, 0);
  };
  part();
  // Whatever the priorities: what runs away beside a parameter that is held is held in its stead. Each exchange makes
  // the held part of the null basis kRunsAway times as large at least, so they end.
  for (std::optional<std::pair<int, int>> found; (found = runaway(gauge, hold));) {
    is_held[static_cast<std::size_t>(found->first)] = false;
    is_held[static_cast<std::size_t>(found->second)] = true;
    part();
  }
  return gauge;
}

double fixing_priority(const Parameter& parameter) {
  const bool turns = parameter.unit == "rad";
  if (parameter.hold > 0) return parameter.hold;
  if (parameter.owner == "base") return 2e-5;  // nothing is known of the instrument's place
  if (parameter.owner == "tool") return turns ? 1e-2 : 1e-3;
  if (parameter.of_effect) return 3;
  return parameter.name == "beta" ? 10 : 1;
}

std::vector<std::string> describe_directions(const Gauge& gauge, const std::vector<const Parameter*>& parameters) {
  constexpr double kVisible = 0.02;  // of the largest part of the direction
  constexpr std::size_t kNamed = 5;
  const auto name = [&](Eigen::Index k) { return parameters[static_cast<std::size_t>(k)]->label(); };
  std::vector<std::string> out;
  for (Eigen::Index column = 0; column < gauge.directions.cols(); ++column) {
    const Eigen::VectorXd direction = gauge.directions.col(column);
    const Eigen::Index held = gauge.held[static_cast<std::size_t>(column)];
    std::vector<Eigen::Index> parts;
    for (Eigen::Index k = 0; k < direction.size(); ++k) {
      if (k != held && std::abs(direction[k]) > kVisible * direction.cwiseAbs().maxCoeff()) parts.push_back(k);
    }
    if (parts.empty()) {
      out.push_back(name(held) + " is not observable");
      continue;
    }
    std::stable_sort(parts.begin(), parts.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return std::abs(direction[a]) > std::abs(direction[b]); });
    const std::size_t more = parts.size() > kNamed ? parts.size() - kNamed : 0;
    parts.resize(parts.size() - more);
    bool all_turn = parameters[static_cast<std::size_t>(held)]->unit == "rad";
    std::string text = name(held);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      all_turn = all_turn && parameters[static_cast<std::size_t>(parts[k])]->unit == "rad";
      text += (k + 1 == parts.size() && more == 0 ? " and " : ", ") + name(parts[k]);
    }
    if (more > 0) text += " and " + std::to_string(more) + " more";
    out.push_back(text + (all_turn && more == 0 ? " turn together" : " move together"));
  }
  return out;
}

std::vector<std::string> describe_directions(const Gauge& gauge, const std::vector<Parameter>& parameters) {
  std::vector<const Parameter*> there;
  there.reserve(parameters.size());
  for (const Parameter& parameter : parameters) there.push_back(&parameter);
  return describe_directions(gauge, there);
}

}  // namespace fastcal
