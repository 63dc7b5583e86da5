// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/robust_noise.hpp"

namespace fastcal {

void coarse_fit(FitState& fit) {
  constexpr double kWeak = 30;  // plausible sizes
  Limits weak = fit.limits;
  if (!fit.has_priors()) {
    weak.prior_mean = fit.start;
    weak.prior_sigma = Eigen::VectorXd::Constant(fit.start.size(), std::numeric_limits<double>::infinity());
  }
  for (std::size_t k = 0; k < fit.asked.size(); ++k) {
    double& sigma = weak.prior_sigma[fit.asked[k]];
    if (!std::isfinite(sigma)) weak.prior_mean[fit.asked[k]] = fit.start[fit.asked[k]];
    sigma = std::min(sigma, kWeak * fit.scale[static_cast<Eigen::Index>(k)]);
  }
  fit.tau = noise(fit, NoiseRule::kMedian, LossKind::kHuber);
  for (int round = 0; round < 20; ++round) {
    // Few steps a round: this is a start, and the next round weights the rows anew.
    const Solution solution = solve(fit.problem, fit.theta, fit.asked, fit.scale, {fit.tau, LossKind::kHuber}, weak,
                                    {Method::kLeastSquares, 3, 0.1});
    fit.theta = solution.theta;
    fit.bring_to_equilibrium();
    const CommonNoise before = fit.tau;
    fit.tau = noise(fit, NoiseRule::kMedian, LossKind::kHuber);
    if (largest_change(before, fit.tau) < 0.05) break;
  }
}

}  // namespace fastcal
