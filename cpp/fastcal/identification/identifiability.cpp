// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identifiability.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {

namespace {

/// What R does nothing to, and how many of its directions do anything at all.
struct NullSpace {
  int rank = 0;
  Eigen::MatrixXd basis;  // (p, lost), orthonormal
};

/// By QR with column pivoting, R P = Q [R1 R2; 0 R3], at a tenth of the price of an SVD: sigma_r >= 1 / |R1^-1| and
/// sigma_r+1 <= |R3| (Frobenius norms). Nothing where these bounds leave any doubt of what the singular values would
/// say.
std::optional<NullSpace> clear_null_space(const Eigen::MatrixXd& R, const GaugeOptions& options) {
  constexpr double kClearly = 100;
  const Eigen::Index p = R.cols();
  if (!R.allFinite() || R.rows() < p) return {};
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(R);
  const Eigen::MatrixXd& packed = qr.matrixQR();
  const double least = packed.diagonal().cwiseAbs().maxCoeff();  // that the largest singular value can be
  const double most = R.norm();
  const Eigen::Index rank = (packed.diagonal().cwiseAbs().array() > options.relative_tolerance * most).count();
  if (rank == 0 || (options.off && rank < p)) return {};
  const auto R1 = packed.topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
  const double smallest = 1 / R1.solve(Eigen::MatrixXd::Identity(rank, rank)).norm();
  const Eigen::MatrixXd R3 = packed.block(rank, rank, p - rank, p - rank).triangularView<Eigen::Upper>();
  const bool clear = smallest >= kClearly * options.relative_tolerance * most &&
                     smallest * options.practical_limit >= 1 &&
                     kClearly * R3.norm() <= options.relative_tolerance * least;
  if (!clear) return {};
  if (rank == p) return NullSpace{static_cast<int>(rank), Eigen::MatrixXd(p, 0)};
  Eigen::MatrixXd null(p, p - rank);
  null.topRows(rank) = -R1.solve(packed.block(0, rank, rank, p - rank));
  null.bottomRows(p - rank).setIdentity();
  const Eigen::HouseholderQR<Eigen::MatrixXd> orthonormal(qr.colsPermutation() * null);
  return NullSpace{static_cast<int>(rank), orthonormal.householderQ() * Eigen::MatrixXd::Identity(p, p - rank)};
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

}  // namespace

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
  for (int k = 0; k < p; ++k) (is_held[static_cast<std::size_t>(k)] ? gauge.held : gauge.free).push_back(k);
  if (lost > 0) {
    Eigen::MatrixXd at_held(lost, lost);
    for (Eigen::Index k = 0; k < lost; ++k) at_held.row(k) = null.row(gauge.held[static_cast<std::size_t>(k)]);
    gauge.directions = null * at_held.fullPivHouseholderQr().inverse();
  } else {
    gauge.directions.resize(p, 0);
  }
  return gauge;
}

double fixing_priority(const Parameter& parameter) {
  const bool turns = parameter.unit == "rad";
  if (parameter.owner == "base") return 2e-5;  // nothing is known of the instrument's place
  if (parameter.owner == "tool") return turns ? 1e-2 : 1e-3;
  if (parameter.of_effect) return 3;
  return parameter.name == "beta" ? 10 : 1;
}

std::vector<std::string> describe_directions(const Gauge& gauge, const std::vector<Parameter>& parameters) {
  constexpr double kVisible = 0.02;  // of the largest part of the direction
  constexpr std::size_t kNamed = 5;
  const auto name = [&](Eigen::Index k) { return parameters[static_cast<std::size_t>(k)].label(); };
  std::vector<std::string> out;
  for (Eigen::Index column = 0; column < gauge.directions.cols(); ++column) {
    const Eigen::VectorXd direction = gauge.directions.col(column);
    const Eigen::Index held = gauge.held[static_cast<std::size_t>(column)];
    std::vector<Eigen::Index> parts;
    for (Eigen::Index k = 0; k < direction.size(); ++k) {
      if (k != held && std::abs(direction[k]) > kVisible * direction.cwiseAbs().maxCoeff()) parts.push_back(k);
    }
    if (parts.empty()) {
      out.push_back(name(held) + " changes nothing that was measured");
      continue;
    }
    std::stable_sort(parts.begin(), parts.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return std::abs(direction[a]) > std::abs(direction[b]); });
    const std::size_t more = parts.size() > kNamed ? parts.size() - kNamed : 0;
    parts.resize(parts.size() - more);
    bool all_turn = parameters[static_cast<std::size_t>(held)].unit == "rad";
    std::string text = name(held);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      all_turn = all_turn && parameters[static_cast<std::size_t>(parts[k])].unit == "rad";
      text += (k + 1 == parts.size() && more == 0 ? " and " : ", ") + name(parts[k]);
    }
    if (more > 0) text += " and " + std::to_string(more) + " more";
    out.push_back(text + (all_turn && more == 0 ? " turn together" : " move together"));
  }
  return out;
}

}  // namespace fastcal
