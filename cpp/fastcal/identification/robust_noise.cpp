// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/robust_noise.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fastcal/identification/noise_scale.hpp"

namespace fastcal {
namespace {

// Below this a residual is rounding, not noise: exact, simulated data must not divide by zero.
constexpr double kNoiseFloor = 1e-10;  // [m or rad]

// Degrees of freedom below which the noise that is found is drawn to a plausible one, with the weight of one number
// where none is left.
constexpr double kFewFreedoms = 5;
constexpr double kPlausibleNoise = 1e-4;  // [m or rad]: a tracker's or a good camera's

constexpr double kFreedomForOutliers = 1.0 / 3;  // of the measured numbers

/// Degrees of freedom that the present fit leaves.
double degrees(const FitState& fit) { return fit.freedom * fit.measured_count; }

/// Rows whose squares, over the factor, no normal noise explains.
std::vector<bool> explained(const std::vector<RowWeight>& rows, double factor) {
  const auto used = static_cast<double>(
      std::count_if(rows.begin(), rows.end(), [](const RowWeight& row) { return row.components > 0; }));
  std::array<double, kMostNumbers + 1> limit{};  // found where it is needed
  std::vector<bool> out(rows.size(), true);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].components == 0) continue;
    double& here = limit[rows[i].components];
    if (here == 0) here = outlier_limit(rows[i].components, used);
    out[i] = rows[i].squared <= factor * here;
  }
  return out;
}

/// Mean square of the rows that it explains itself, over what the fit leaves of it.
double variance_factor(const FitState& fit, const std::vector<RowWeight>& rows) {
  double factor = 1;
  for (int round = 0; round < 50; ++round) {
    const std::vector<bool> kept =
        fit.loss == LossKind::kNone ? std::vector<bool>(rows.size(), true) : explained(rows, factor);
    double sum = 0;
    double count = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!kept[i]) continue;
      sum += rows[i].squared;
      count += rows[i].components;
    }
    if (!(count > 0 && sum > 0)) return factor;
    const double before = factor;
    factor = sum / (count * fit.freedom);
    if (std::abs(factor - before) <= 1e-9 * factor) break;
  }
  return factor;
}

}  // namespace

CommonNoise noise(FitState& fit, NoiseRule rule, LossKind loss) {
  if (!fit.options.noise.empty()) return fit.options.noise;
  const RowMatrixXd& r = fit.residuals_here();
  CommonNoise out(fit.tau.size(), kNoiseFloor);
  for (std::size_t k = 0; k < out.size(); ++k) {
    const ObservedRows rows =
        rows_of(fit.problem, r, static_cast<int>(k), rule == NoiseRule::kKept ? fit.kept : std::vector<bool>());
    if (rows.count() == 0) continue;
    if (rule == NoiseRule::kMedian) out[k] = median_noise(rows, kNoiseFloor, fit.tau[k]);
    if (rule == NoiseRule::kMean) out[k] = mean_noise(rows, loss, fit.freedom, kNoiseFloor, fit.tau[k]);
    if (rule == NoiseRule::kKept) out[k] = mean_noise(rows, LossKind::kNone, fit.freedom, kNoiseFloor, fit.tau[k]);
    const double own = degrees(fit);
    if (rule != NoiseRule::kMedian && !fit.claims && own < kFewFreedoms) {
      const double prior = 1 - own / kFewFreedoms;
      const double squares = prior * kPlausibleNoise * kPlausibleNoise + own * out[k] * out[k];
      out[k] = std::sqrt(squares / (prior + own));
    }
  }
  return out;
}

double largest_change(const CommonNoise& a, const CommonNoise& b) {
  double change = 0;
  for (std::size_t k = 0; k < a.size(); ++k) change = std::max(change, std::abs(a[k] - b[k]) / std::max(a[k], b[k]));
  return change;
}

std::vector<Eigen::Index> counts(const Measurements& measured, const RowMatrixXd& residuals) {
  std::vector<Eigen::Index> out(measured.observations().size(), 0);
  for (Eigen::Index i = 0; i < residuals.rows(); ++i) {
    for (int c = 0; c < measured.number_count(); ++c) out[measured.observation_of(c)] += !std::isnan(residuals(i, c));
  }
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

void keep_rows(FitState& fit, std::vector<bool> kept) {
  fit.kept = std::move(kept);
  const RowMatrixXd& r = fit.numbers();
  Eigen::Index count = 0;
  if (fit.kept.empty()) {
    count = (r.array() == r.array()).count();
  } else {
    for (Eigen::Index i = 0; i < r.rows(); ++i) {
      if (fit.kept[static_cast<std::size_t>(i)]) count += (r.row(i).array() == r.row(i).array()).count();
    }
  }
  fit.measured_count = static_cast<double>(count);
  if (!fit.free.empty()) count_freedom(fit);
}

std::vector<bool> explained_rows(FitState& fit) {
  return explained(row_weights(fit.problem, fit.residuals_here(), {fit.tau, fit.loss}), 1);
}

bool shows_outliers(FitState& fit) {
  return fit.measured_count - effective_parameters(fit) >= kFreedomForOutliers * fit.measured_count;
}

void report_noise(const FitState& fit, Identification& out) {
  const Measurements& from = fit.problem.measured;
  CommonNoise squares(fit.tau.size(), 0.0);
  const auto measured = counts(from, out.residuals);
  for (std::size_t k = 0; k < squares.size(); ++k)
    squares[k] = static_cast<double>(measured[k]) * fit.tau[k] * fit.tau[k];
  for (int c = 0; fit.claims && c < from.number_count(); ++c) {
    for (Eigen::Index i = 0; i < out.residuals.rows(); ++i) {
      const double own = std::isnan(out.residuals(i, c)) ? 0 : from.sigma(i, c);
      squares[from.observation_of(c)] += own * own;
    }
  }
  out.tau = fit.tau;
  out.sigma.assign(fit.tau.size(), 0.0);
  for (std::size_t k = 0; k < squares.size(); ++k) {
    if (measured[k] == 0) {
      out.tau[k] = 0;
      continue;
    }
    if (fit.tau[k] <= kNoiseFloor && fit.claims) out.tau[k] = 0;
    out.sigma[k] = std::sqrt(squares[k] / static_cast<double>(measured[k]));
  }
  out.variance_factor = variance_factor(fit, out.weights);
  const std::vector<bool> kept = explained(out.weights, out.variance_factor);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) out.outliers.push_back(static_cast<int>(i));
  }
  for (double& sigma : out.sigma) sigma *= std::sqrt(out.variance_factor);
}

}  // namespace fastcal
