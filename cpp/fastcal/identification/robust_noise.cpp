// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/robust_noise.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/identification/noise_scale.hpp"

namespace fastcal {
namespace {

// Below this a residual is rounding, not noise: exact, simulated data must not divide by zero.
constexpr CommonNoise kNoiseFloor{1e-10, 1e-10, 1e-10};

/// The weights are taken at the noise that comes out.
double variance_factor(const FitState& fit, const std::vector<RowWeight>& weights) {
  double factor = 1;
  for (int round = 0; round < 50; ++round) {
    double sum = 0;
    double expected = 0;
    for (const RowWeight& row : weights) {
      if (row.components == 0) continue;
      const Loss& rho = tuned_loss(fit.loss, row.components);
      const double s = row.squared / fit.freedom;
      const double weight = rho.weight(s / factor);
      if (!(weight > 0)) continue;
      sum += weight * s;
      expected += rho.consistency * row.components;
    }
    if (!(expected > 0 && sum > 0)) return factor;
    const double change = std::abs(sum / expected - factor);
    factor = sum / expected;
    if (change <= 1e-9 * factor) break;
  }
  return factor;
}

}  // namespace

CommonNoise noise(FitState& fit, NoiseRule rule, LossKind loss) {
  const RowMatrixXd& r = fit.residuals_here();
  CommonNoise out = kNoiseFloor;
  for (std::size_t k = 0; k < out.size(); ++k) {
    const std::vector<KindRow> rows = rows_of_kind(fit.problem, r, static_cast<int>(k));
    if (rows.empty()) continue;
    if (rule == NoiseRule::kMedian) out[k] = median_noise(rows, kNoiseFloor[k], fit.tau[k]);
    if (rule == NoiseRule::kMean) out[k] = mean_noise(rows, loss, fit.freedom, kNoiseFloor[k], fit.tau[k]);
    if (rule == NoiseRule::kClean) out[k] = clean_noise(rows, fit.freedom, kNoiseFloor[k], fit.tau[k]);
  }
  return out;
}

double largest_change(const CommonNoise& a, const CommonNoise& b) {
  double change = 0;
  for (std::size_t k = 0; k < a.size(); ++k) change = std::max(change, std::abs(a[k] - b[k]) / std::max(a[k], b[k]));
  return change;
}

std::array<Eigen::Index, kKinds> counts(const RowMatrixXd& residuals) {
  std::array<Eigen::Index, kKinds> out{};
  for (int c = 0; c < kComponents; ++c)
    out[static_cast<std::size_t>(kind_of(c))] += (residuals.col(c).array() == residuals.col(c).array()).count();
  return out;
}

double effective_parameters(FitState& fit) {
  if (!fit.has_priors()) return static_cast<double>(fit.free.size());
  const Eigen::MatrixXd J = fit.free_factor();
  const Eigen::MatrixXd R = with_priors(J, fit.free, fit.free_scale, fit.limits);
  return R.transpose().triangularView<Eigen::Lower>().solve(J.transpose()).squaredNorm();
}

void count_freedom(FitState& fit) {
  fit.freedom = std::max(1.0, fit.measured_count - effective_parameters(fit)) / fit.measured_count;
}

void report_noise(const FitState& fit, Identification& out) {
  CommonNoise squares{};
  const auto measured = counts(out.residuals);
  for (int c = 0; c < kComponents; ++c) {
    const auto k = static_cast<std::size_t>(kind_of(c));
    for (Eigen::Index i = 0; i < out.residuals.rows(); ++i) {
      if (std::isnan(out.residuals(i, c))) continue;
      const double own = fit.problem.measured.sigma(i, c);
      squares[k] += own * own + fit.tau[k] * fit.tau[k];
    }
  }
  out.tau = fit.tau;
  for (std::size_t k = 0; k < squares.size(); ++k) {
    if (measured[k] == 0) {
      out.tau[k] = 0;
      continue;
    }
    if (fit.tau[k] <= kNoiseFloor[k] && fit.claims) out.tau[k] = 0;
    out.sigma[k] = std::sqrt(squares[k] / static_cast<double>(measured[k]));
  }
  out.variance_factor = variance_factor(fit, out.weights);
  for (double& sigma : out.sigma) sigma *= std::sqrt(out.variance_factor);
}

}  // namespace fastcal
