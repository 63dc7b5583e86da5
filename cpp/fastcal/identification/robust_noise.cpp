// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/robust_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "fastcal/identification/noise_scale.hpp"
#include "fastcal/identification/reduced_problem.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

// Below this a residual is rounding, not noise: exact, simulated data must not divide by zero.
constexpr double kNoiseFloor = 1e-10;  // [m or rad]

// Degrees of freedom below which the noise that is found is drawn to a plausible one, with the weight of one number
// where none is left.
constexpr double kFewFreedoms = 5;
constexpr double kPlausibleNoise = 1e-4;  // [m or rad]: a tracker's or a good camera's

// Numbers of an observation below which its own unknowns may take nearly all of them: its noise is then no less than
// that of others of its unit, or a plausible one.
constexpr double kFewNumbers = 20;

constexpr double kFreedomForOutliers = 1.0 / 3;  // of the measured numbers

/// Degrees of freedom that the present fit leaves.
double degrees(const FitState& fit) { return fit.freedom * fit.measured_count; }

/// Which rows a normal noise, its variance times the factor, explains.
std::vector<bool> explained(const RowErrors& rows, const CommonNoise& tau, double factor) {
  using Counts = std::vector<Eigen::Index>;  // of rows, by how many numbers they have
  Counts counts(static_cast<std::size_t>(rows.most_numbers()) + 1);
  rows.sum_rows(
      counts, [&](Counts& sums, Eigen::Index i) { ++sums[static_cast<std::size_t>(rows.components(i))]; },
      [&](const Counts& sums) {
        for (std::size_t d = 0; d < sums.size(); ++d) counts[d] += sums[d];
      });
  const auto used = static_cast<double>(rows.row_count() - counts[0]);
  std::vector<double> limit(counts.size());
  for (std::size_t d = 1; d < limit.size(); ++d) {
    if (counts[d] > 0) limit[d] = outlier_limit(static_cast<int>(d), used);
  }
  std::vector<bool> out(static_cast<std::size_t>(rows.row_count()), true);
  rows.each_row([&](Eigen::Index i) {
    const RowWeight row = rows.whitened(i, tau);
    if (row.components > 0)
      out[static_cast<std::size_t>(i)] = row.squared <= factor * limit[static_cast<std::size_t>(row.components)];
  });
  return out;
}

/// Mean square of the rows that it explains itself, over what the fit leaves of it.
double variance_factor(const FitState& fit, const RowErrors& rows) {
  double factor = 1;
  for (int round = 0; round < 50; ++round) {
    std::vector<bool> kept;
    if (fit.loss != LossKind::kNone) kept = explained(rows, fit.tau, factor);
    double sum = 0;
    double count = 0;
    rows.sum_rows(
        RowWeight{},
        [&](RowWeight& sums, Eigen::Index i) {
          if (!kept.empty() && !kept[static_cast<std::size_t>(i)]) return;
          const RowWeight row = rows.whitened(i, fit.tau);
          sums.squared += row.squared;
          sums.components += row.components;
        },
        [&](const RowWeight& sums) {
          sum += sums.squared;
          count += sums.components;
        });
    if (!(count > 0 && sum > 0)) return factor;
    const double before = factor;
    factor = sum / (count * fit.freedom);
    if (std::abs(factor - before) <= 1e-9 * factor) break;
  }
  return factor;
}

/// The noise of observations of few numbers, which would be that of a fit through them, as large as others have it.
void lift_few(const FitState& fit, const RowErrors& errors, CommonNoise& tau) {
  const std::vector<PlacedObservation>& observations = fit.problem.measured.observations();
  const auto is_judged = [&](std::size_t k) {
    return !observations[k]->claims_sigma() && errors.number_count(static_cast<int>(k)) > 0;
  };
  for (std::size_t k = 0; k < tau.size() && tau.size() > 1; ++k) {
    const auto own = static_cast<double>(errors.number_count(static_cast<int>(k)));
    if (!is_judged(k) || own >= kFewNumbers) continue;
    double squares = 0;
    double count = 0;
    for (std::size_t j = 0; j < tau.size(); ++j) {
      const auto numbers = static_cast<double>(errors.number_count(static_cast<int>(j)));
      if (!is_judged(j) || numbers < kFewNumbers || observations[j]->unit() != observations[k]->unit()) continue;
      squares += numbers * tau[j] * tau[j];
      count += numbers;
    }
    const double others = count > 0 ? std::sqrt(squares / count) : kPlausibleNoise;
    tau[k] = std::max(tau[k], std::sqrt(1 - own / kFewNumbers) * others);
  }
}

}  // namespace

CommonNoise noise(FitState& fit, NoiseRule rule, LossKind loss) {
  if (!fit.options.noise.empty()) return fit.options.noise;
  const RowErrors& errors = fit.errors_here();
  CommonNoise out(fit.tau.size(), kNoiseFloor);
  for (std::size_t k = 0; k < out.size(); ++k) {
    const ObservedRows rows =
        errors.observed(static_cast<int>(k), rule == NoiseRule::kKept ? fit.kept : std::vector<bool>());
    if (rows.count() == 0 || fit.problem.measured.observations()[k]->is_known()) continue;
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
  lift_few(fit, errors, out);
  return out;
}

double largest_change(const CommonNoise& a, const CommonNoise& b) {
  double change = 0;
  for (std::size_t k = 0; k < a.size(); ++k) change = std::max(change, std::abs(a[k] - b[k]) / std::max(a[k], b[k]));
  return change;
}

double effective_parameters(FitState& fit) {
  if (!fit.has_priors()) return static_cast<double>(fit.free.size());
  const Eigen::MatrixXd J = fit.free_factor();
  const Eigen::MatrixXd R = with_priors(J, fit.free, fit.free_scale, fit.limits);
  return divided_by_lower(J, R).squaredNorm();
}

double effective_parameters(const FitState& fit, const Eigen::MatrixXd& A) {
  const auto p = static_cast<Eigen::Index>(fit.free.size());
  if (!fit.has_priors()) return static_cast<double>(p);
  // tr(A (A + P)^-1) = p - tr(P (A + P)^-1) with the priors' P diagonal.
  Eigen::VectorXd prior = fit.free_scale.cwiseQuotient(at(fit.limits.prior_sigma, fit.free)).cwiseAbs2();
  Eigen::MatrixXd with_prior = A;
  with_prior.diagonal() += prior;
  return static_cast<double>(p) - prior.dot(Root(with_prior, Eigen::VectorXd::Zero(p)).inverse_diagonal());
}

void count_freedom(FitState& fit, double effective) {
  fit.effective = effective;
  fit.freedom = std::max(1.0, fit.measured_count - effective) / fit.measured_count;
}

void keep_rows(FitState& fit, std::vector<bool> kept) {
  fit.kept = std::move(kept);
  Eigen::Index count = 0;
  if (fit.kept.empty()) {
    const std::vector<Eigen::Index>& counts = fit.counts();
    count = std::accumulate(counts.begin(), counts.end(), Eigen::Index{0});
  } else {
    const RowErrors& rows = fit.errors_here();
    for (Eigen::Index i = 0; i < rows.row_count(); ++i) {
      if (fit.kept[static_cast<std::size_t>(i)]) count += rows.components(i);
    }
  }
  fit.measured_count = static_cast<double>(count);
  if (!fit.free.empty()) count_freedom(fit, fit.effective);
}

std::vector<bool> explained_rows(FitState& fit) { return explained(fit.errors_here(), fit.tau, 1); }

bool shows_outliers(const FitState& fit) {
  return fit.measured_count - fit.effective >= kFreedomForOutliers * fit.measured_count;
}

void report_noise(FitState& fit, const RowErrors& errors, Identification& out) {
  const std::vector<Eigen::Index>& measured = fit.counts();
  out.tau = fit.tau;
  out.sigma.assign(fit.tau.size(), 0.0);
  for (std::size_t k = 0; k < fit.tau.size(); ++k) {
    if (measured[k] == 0) {
      out.tau[k] = 0;
      continue;
    }
    const auto count = static_cast<double>(measured[k]);
    const double squares = count * fit.tau[k] * fit.tau[k] + errors.claimed_variance(static_cast<int>(k));
    if (fit.tau[k] <= kNoiseFloor && fit.claims) out.tau[k] = 0;
    out.sigma[k] = std::sqrt(squares / count);
  }
  out.variance_factor = variance_factor(fit, errors);
  const std::vector<bool> kept = explained(errors, fit.tau, out.variance_factor);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) out.outliers.push_back(static_cast<int>(i));
  }
  for (double& sigma : out.sigma) sigma *= std::sqrt(out.variance_factor);
}

}  // namespace fastcal
