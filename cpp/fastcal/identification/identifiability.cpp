// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identifiability.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {

Gauge choose_gauge(const Eigen::MatrixXd& R, const Eigen::VectorXd& hold, const GaugeOptions& options) {
  const Eigen::Index p = R.cols();
  Gauge gauge;
  if (p == 0) return gauge;
  const RightSvd svd = right_svd(R);
  gauge.singular_values = svd.values;
  const double largest = gauge.singular_values[0];
  Eigen::Index kept = 0;
  for (Eigen::Index k = 0; k < p; ++k) {
    const double s = gauge.singular_values[k];
    if (s > options.relative_tolerance * largest && s > 0) {
      ++gauge.rank;
      if (s * options.practical_limit >= 1) ++kept;
    }
  }
  if (options.off) {
    FASTCAL_CHECK(gauge.singular_values[p - 1] > 0) << "without a gauge every parameter needs data or a prior";
    kept = p;
  }
  const Eigen::Index lost = p - kept;
  const Eigen::MatrixXd null = svd.V.rightCols(lost);
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
