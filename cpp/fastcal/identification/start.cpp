// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/robust_noise.hpp"

namespace fastcal {
namespace {

/// Parameters and noise in turn, a step a round: this is a start, and the next round weights the rows again. Did steps
/// of Newton bring both to rest?
bool settle_coarsely(FitState& fit, const Limits& weak) {
  constexpr double kCloseEnough = 1;    // standard deviations
  constexpr double kNoiseStands = 0.3;  // relative
  const bool is_ceres_alone = fit.options.solver.method == Method::kTrustRegion;
  const Method method = is_ceres_alone ? Method::kTrustRegion : Method::kLeastSquares;
  for (int round = 0; round < 20; ++round) {
    // From the start the noise is large and nearly all rows are within the bend of the loss.
    Stepped step;
    if (method != Method::kTrustRegion) {
      step = fit.step(LossKind::kHuber, fit.asked, fit.scale, weak, kCostTells, round > 0);
    }
    if (!step.is_good) {
      fit.theta =
          solve(fit.problem, fit.theta, fit.asked, fit.scale, {fit.tau, LossKind::kHuber}, weak, {method, 3, 0.1})
              .theta;
    }
    fit.bring_to_equilibrium();
    const CommonNoise before = fit.tau;
    fit.tau = noise(fit, NoiseRule::kMedian, LossKind::kHuber);
    if (step.rest < kCloseEnough && largest_change(before, fit.tau) < kNoiseStands) return step.is_good;
  }
  return false;
}

double cost(const FitState& fit, const CommonNoise& tau) {
  return normal_equations(fit.problem, fit.theta, fit.asked, fit.scale, {tau, LossKind::kHuber}, false).cost;
}

/// Moves the unknowns of an observation to their mirror image where all fits better from there.
void try_mirror(FitState& fit, Limits weak, const PlacedObservation& of) {
  constexpr double kClearly = 1;  // of the cost: what both fit alike stays as it is, on every machine
  const int parameters = fit.problem.model.parameter_count();
  std::vector<Sights> sights;
  RowEvaluator evaluator(fit.problem.model, fit.theta.head(parameters));
  for (Eigen::Index i = 0; i < fit.problem.samples.count(); ++i) {
    const std::vector<Pose>& T = evaluator.frames(fit.problem.samples.row(i));
    sights.push_back(sights_of(of, [&](int frame) { return T[frame]; }));
  }
  const int first = parameters + of.first_unknown;
  Eigen::VectorXd image = fit.theta.segment(first, of.unknown_count);
  if (!of->mirror(sights, image)) return;
  const Eigen::VectorXd theta = fit.theta;
  const CommonNoise tau = fit.tau;
  const double before = cost(fit, tau);
  fit.theta.segment(first, of.unknown_count) = image;
  if (!fit.has_priors()) weak.prior_mean.segment(first, of.unknown_count) = image;
  fit.forget();
  settle_coarsely(fit, weak);
  if (cost(fit, tau) < before - kClearly) {
    fit.start.segment(first, of.unknown_count) = image;
    return;
  }
  fit.theta = theta;
  fit.tau = tau;
  fit.bring_to_equilibrium();
}

}  // namespace

bool coarse_fit(FitState& fit) {
  constexpr double kWeak = 30;      // plausible sizes
  constexpr double kWeakLoops = 3;  // rods far from theirs assemble in another way, from where no step leads back
  const double reach = fit.problem.model.robot().chain().has_loops() ? kWeakLoops : kWeak;
  Limits weak = fit.limits;
  if (!fit.has_priors()) {
    weak.prior_mean = fit.start;
    weak.prior_sigma = Eigen::VectorXd::Constant(fit.start.size(), std::numeric_limits<double>::infinity());
  }
  for (std::size_t k = 0; k < fit.asked.size(); ++k) {
    double& sigma = weak.prior_sigma[fit.asked[k]];
    if (!std::isfinite(sigma)) weak.prior_mean[fit.asked[k]] = fit.start[fit.asked[k]];
    sigma = std::min(sigma, reach * fit.scale[static_cast<Eigen::Index>(k)]);
  }
  fit.tau = noise(fit, NoiseRule::kMedian, LossKind::kHuber);
  const bool settled = settle_coarsely(fit, weak);
  for (const PlacedObservation& of : fit.problem.measured.observations()) {
    if (of.unknown_count > 0) try_mirror(fit, weak, of);
  }
  return settled;
}

}  // namespace fastcal
