// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/robust_fit.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fastcal/identification/gauge.hpp"

namespace fastcal {
namespace {

constexpr int kMaxRounds = 30;
constexpr int kMaxOuterRounds = 30;
constexpr double kLoadsSettled = 1e-8;     // of a plausible size
constexpr double kLeastFreedom = 1.0 / 3;  // of the degrees of freedom must stay when outliers are dropped
constexpr double kStay = 0.9;              // of the rows that are kept must stay when loads are computed anew
constexpr double kNoiseTolerance = 0.01;   // relative, of the rows that are kept
constexpr int kRoundsOfReturn = 10;        // in which a dropped row may come back; later, some would for ever
constexpr double kStepConverged = 3e-5;    // standard deviations: as far as a solve comes
constexpr double kNearly = 0.003;          // standard deviations: no row changes sides
constexpr double kUnjudged = 0.1;          // standard deviations: the slope at the end of so short a step tells enough
constexpr int kMaxSteps = 10;              // of Newton, before Ceres' trust region
constexpr double kRoughly = 1;             // standard deviations, at most
constexpr double kNoiseStands = 2e-4;      // relative: the last step can take in such a change
constexpr double kNoiseTuned = 0.15;       // relative, before the outliers are dropped
constexpr int kMaxPolishing = 10;
constexpr double kAtTheMinimum = 1e-10;  // standard deviations: the last step of all
constexpr double kNoiseSettled =
    1e-4;  // relative; the parameters move by far less than their deviation when the noise moves by this

}  // namespace

void RobustFit::begin() {
  const std::vector<Eigen::Index>& measured = fit_.counts();
  observed_ = std::count_if(measured.begin(), measured.end(), [](Eigen::Index count) { return count > 0; });
  keep_rows(fit_, {});
}

void RobustFit::run(bool from_near, bool knows_noise) {
  count_freedom(fit_, effective_parameters(fit_));
  for (int round = 0; round < kMaxRounds; ++round) {
    fine_fit(from_near, knows_noise);
    if (fit_.problem.model.needs() == kNothing) return;
    const CommonNoise before = noise(fit_, rule_, fit_.loss);
    if (!settle_loads()) return;
    // The loads were right to a per mille already, so the noise hardly moves: it is found again only where it does.
    if (largest_change(before, noise(fit_, rule_, fit_.loss)) < kNoiseSettled) return;
  }
}

bool RobustFit::settle_loads() {
  for (int round = 0; round < kMaxOuterRounds; ++round) {
    const Eigen::VectorXd before = at(fit_.theta, fit_.free);
    fit_.bring_to_equilibrium();
    if (loses_rows()) refit(LossKind::kHuber, fit_.options.solver);
    refit(fit_.loss, fit_.options.solver);
    const Eigen::VectorXd moved = (at(fit_.theta, fit_.free) - before).cwiseQuotient(fit_.free_scale);
    if (moved.cwiseAbs().maxCoeff() < kLoadsSettled || deviations(moved) < kStepConverged) return true;
  }
  converged_ = false;
  message_ = "loads and deflections did not settle in " + std::to_string(kMaxOuterRounds) + " outer iterations";
  return false;
}

bool RobustFit::loses_rows() {
  if (fit_.loss == LossKind::kNone || fit_.kept.empty()) return false;
  const std::vector<bool> now = explained_rows(fit_);
  const auto count = [](const std::vector<bool>& rows) {
    return static_cast<double>(std::count(rows.begin(), rows.end(), true));
  };
  return count(now) < kStay * count(fit_.kept);
}

double RobustFit::deviations(const Eigen::VectorXd& step) const {
  if (near_.rows() == step.size()) return std::sqrt(std::max(0.0, step.dot(near_ * step)));
  const NormalEquations near =
      normal_equations(fit_.problem, fit_.theta, fit_.free, fit_.free_scale, {fit_.tau, fit_.loss}, true);
  return std::sqrt(std::max(0.0, step.dot(near.A * step)));
}

void RobustFit::polish() {
  SolverOptions solver = fit_.options.solver;
  if (!converged_ || !is_least_squares(solver.method)) return;
  if (solver.method == Method::kLeastSquares && step_to_the_minimum()) return;
  solver.settled = kAtTheMinimum;
  refit(fit_.loss, solver);
  count_freedom(fit_, effective_parameters(fit_));
  fit_.tau = noise(fit_, rule_, fit_.loss);
  if (fit_.problem.model.needs() != kNothing) {
    polish_with_loads(solver);
  } else if (!noise_is_a_factor()) {
    refit(fit_.loss, solver);
    fit_.tau = noise(fit_, rule_, fit_.loss);
  }
  converged_ = true;
}

bool RobustFit::step_to_the_minimum() {
  const Limits& limits = fit_.limits;
  if (fit_.problem.model.needs() != kNothing || fit_.has_priors() || limits.pull_sigma.size() > 0) return false;
  const bool is_factor = noise_is_a_factor();
  if (!is_factor) fit_.tau = noise(fit_, rule_, fit_.loss);
  bool is_near = rest_ <= kNearly && (is_factor || largest_change(fitted_at_, fit_.tau) < kNoiseStands);
  for (int k = 0; k < kMaxSteps; ++k) {
    if (is_near && fit_.step_with_factor(is_factor)) {
      message_ = "converged: the next step is below 0.0001 standard deviations";
      return true;
    }
    const Stepped step = fit_.step(fit_.loss, fit_.free, fit_.free_scale, limits, kUnjudged);
    if (!step.is_good) return false;
    ++iterations_;
    is_near = step.rest <= kNearly;
  }
  return false;
}

void RobustFit::polish_with_loads(const SolverOptions& solver) {
  for (int round = 0; round < kMaxPolishing; ++round) {
    const Eigen::VectorXd before = at(fit_.theta, fit_.free);
    if (round < 2) follow_loads(fit_);  // the loads' response is part of the slope, and was taken far from here
    fit_.bring_to_equilibrium();
    refit(fit_.loss, solver);
    const Eigen::VectorXd moved = (at(fit_.theta, fit_.free) - before).cwiseQuotient(fit_.free_scale);
    if (deviations(moved) < kAtTheMinimum) return;
    fit_.tau = noise(fit_, rule_, fit_.loss);
  }
}

bool RobustFit::noise_is_a_factor() const {
  return fit_.loss == LossKind::kNone && observed_ == 1 && !fit_.claims && !fit_.has_priors();
}

double RobustFit::roughly() const {
  return std::min(kRoughly, std::sqrt(2 * kNoiseStands * fit_.freedom * fit_.measured_count));
}

void RobustFit::refit_roughly(LossKind loss) {
  for (int k = 0; k < kMaxSteps; ++k) {
    if (approach(loss)) return;
  }
}

bool RobustFit::approach(LossKind loss) {
  SolverOptions solver = fit_.options.solver;
  if (solver.method == Method::kLeastSquares) {
    Stepped step = fit_.step(loss, fit_.free, fit_.free_scale, fit_.limits);
    if (step.is_good) {
      ++iterations_;
      near_ = std::move(step.A);
      rest_ = step.rest;
      converged_ = rest_ <= roughly();
      fitted_at_ = fit_.tau;
      count_freedom(fit_, effective_parameters(fit_, near_));
      return converged_;
    }
  }
  solver.settled = std::max(solver.settled, roughly());
  refit(loss, solver);
  const bool knows = near_.rows() == fit_.free_scale.size();
  count_freedom(fit_, knows ? effective_parameters(fit_, near_) : effective_parameters(fit_));
  return true;
}

void RobustFit::refit(LossKind loss, const SolverOptions& solver) {
  Solution solution = fit_.refit(loss, solver);
  rest_ = kFar;
  fitted_at_ = fit_.tau;
  near_ = std::move(solution.A);
  converged_ = solution.converged;
  iterations_ += solution.iterations;
  message_ = solution.message;
}

void RobustFit::fine_fit(bool from_near, bool knows_noise) {
  keep_rows(fit_, {});
  rule_ = NoiseRule::kMean;
  const LossKind loss = fit_.loss = shows_outliers(fit_) ? fit_.options.loss : LossKind::kNone;
  if (loss != LossKind::kNone && !from_near) {
    for (int round = 0; round < kMaxRounds; ++round) {
      const bool is_near = approach(LossKind::kHuber);
      const CommonNoise before = fit_.tau;
      fit_.tau = noise(fit_, NoiseRule::kMedian, LossKind::kHuber);
      if (is_near && largest_change(before, fit_.tau) < kNoiseTolerance) break;
    }
  }
  const bool has_loads = fit_.problem.model.needs() != kNothing;  // then the outer iterations ask for more
  const double tuned = loss == LossKind::kNone || has_loads ? kNoiseSettled : kNoiseTuned;
  bool is_near = false;
  for (int round = 0; round < kMaxRounds; ++round) {
    const CommonNoise before = fit_.tau;
    if (round > 0 || !(knows_noise || noise_is_a_factor())) fit_.tau = noise(fit_, NoiseRule::kMean, loss);
    if (is_near && largest_change(before, fit_.tau) < tuned) break;
    is_near = approach(loss);
    if (is_near && noise_is_a_factor()) {
      tuned_ = fit_.tau = noise(fit_, NoiseRule::kMean, loss);
      return;
    }
  }
  tuned_ = fit_.tau;
  if (loss != LossKind::kNone) drop_outliers();
}

void RobustFit::drop_outliers() {
  const double least = kLeastFreedom * fit_.freedom * fit_.measured_count;
  fit_.tau = noise(fit_, NoiseRule::kMedian, fit_.loss);
  for (double& tau : fit_.tau) tau /= std::sqrt(fit_.freedom);
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<bool> kept = explained_rows(fit_);
    for (std::size_t i = 0; round >= kRoundsOfReturn && i < kept.size(); ++i) kept[i] = kept[i] && fit_.kept[i];
    if (round > 0 && kept == fit_.kept &&
        largest_change(fit_.tau, noise(fit_, NoiseRule::kKept, fit_.loss)) < kNoiseTolerance) {
      return;
    }
    keep_rows(fit_, std::move(kept));
    if (fit_.freedom * fit_.measured_count < least) break;
    rule_ = NoiseRule::kKept;
    fit_.tau = noise(fit_, NoiseRule::kKept, fit_.loss);
    if (largest_change(fitted_at_, fit_.tau) > kNoiseTolerance) refit_roughly(fit_.loss);
  }
  // No set of rows holds together: none is dropped.
  keep_rows(fit_, {});
  rule_ = NoiseRule::kMean;
  fit_.tau = tuned_;
  refit(fit_.loss, fit_.options.solver);
}

}  // namespace fastcal
