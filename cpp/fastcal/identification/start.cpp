// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/robust_noise.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

/// The middle of each of `count` equal parts of the rows.
std::vector<Eigen::Index> spread_rows(Eigen::Index rows, Eigen::Index count) {
  std::vector<Eigen::Index> out(static_cast<std::size_t>(count));
  for (Eigen::Index k = 0; k < count; ++k) out[static_cast<std::size_t>(k)] = (2 * k + 1) * rows / (2 * count);
  return out;
}

}  // namespace

ThinnedProblem::ThinnedProblem(const Problem& whole)
    : ThinnedProblem(whole, spread_rows(whole.row_count(), kThinnedRows)) {}

ThinnedProblem::ThinnedProblem(const Problem& whole, const std::vector<Eigen::Index>& rows)
    : model_(whole.model),
      samples_(whole.samples.pick(rows)),
      measured_(whole.measured.pick(rows)),
      threads_(whole.threads) {}

bool represents(const Eigen::MatrixXd& R_thinned, const Eigen::MatrixXd& R_whole, double share) {
  constexpr double kRepresented = 0.1;  // of the rows' share
  // |R_thinned x|^2 >= kRepresented share |R_whole x|^2 for every x.
  const Eigen::MatrixXd ratio = R_whole.transpose().triangularView<Eigen::Lower>().solve(R_thinned.transpose());
  if (!ratio.allFinite()) return false;
  const Eigen::VectorXd values = right_svd(ratio).values;
  return values.size() == 0 || values.minCoeff() * values.minCoeff() >= kRepresented * share;
}

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
