// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/fit_state.hpp"

#include <cmath>
#include <utility>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

constexpr double kHoldUnknown =
    1e-5;  // what an instrument brings along is never nominal: everything else is held first

}  // namespace

Eigen::VectorXd at(const Eigen::VectorXd& values, const std::vector<int>& indices) { return values(indices); }

Eigen::MatrixXd triangle(const Eigen::MatrixXd& M) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(M).matrixQR().topRows(M.cols()).triangularView<Eigen::Upper>();
}

Eigen::MatrixXd with_priors(const Eigen::MatrixXd& R, const std::vector<int>& indices, const Eigen::VectorXd& scale,
                            const Limits& limits) {
  if (limits.prior_sigma.size() == 0) return R;
  const Eigen::Index p = R.cols();
  Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(2 * p, p);
  stacked.topRows(p) = R;
  for (Eigen::Index k = 0; k < p; ++k) {
    const double sigma = limits.prior_sigma[indices[static_cast<std::size_t>(k)]];
    if (std::isfinite(sigma)) stacked(p + k, k) = scale[k] / sigma;
  }
  return triangle(stacked);
}

FitState::FitState(const Problem& given, std::vector<int> asked_of_model, const Eigen::VectorXd& unknowns,
                   const IdentifyOptions& options_given)
    : settled_(given.model.needs() == kNothing ? Samples() : given.samples),
      problem{given.model,    given.model.needs() == kNothing ? given.samples : settled_,
              given.measured, given.threads,
              nullptr,        &memory_},
      options(options_given),
      limits(options_given.limits),
      parameters(given.model.parameters()),
      asked(std::move(asked_of_model)),
      tau(given.measured.observations().size(), 0.0),
      claims(given.measured.claims_sigma()) {
  for (const Parameter& unknown : given.measured.parameters()) {
    asked.push_back(static_cast<int>(parameters.size()));
    parameters.push_back(unknown);
  }
  start.resize(given.parameter_count());
  start << given.model.start(), unknowns;
  theta = start;
  scale.resize(static_cast<Eigen::Index>(asked.size()));
  hold.resize(scale.size());
  for (Eigen::Index k = 0; k < scale.size(); ++k) {
    const Parameter& parameter = parameters[asked[k]];
    scale[k] = parameter.sigma;
    const double readily = asked[k] < given.model.parameter_count() ? fixing_priority(parameter) : kHoldUnknown;
    // Ties (two parallel axes) fall to the first in the chain, the same on every machine.
    hold[k] = readily * (1 - 1e-3 * static_cast<double>(k) / static_cast<double>(scale.size()));
  }
}

const RowMatrixXd& FitState::residuals_here() {
  if (residuals_.rows() == 0 || residuals_at_ != theta) {
    residuals_ = residuals(problem, theta);
    residuals_at_ = theta;
  }
  return residuals_;
}

const RowMatrixXd& FitState::numbers() {
  if (residuals_.rows() > 0) return residuals_;
  const auto& observations = problem.measured.observations();
  const bool points = observations.size() == 1 && observations.front()->coordinates() != nullptr;
  return points ? *observations.front()->coordinates() : residuals_here();
}

const Eigen::MatrixXd& FitState::asked_factor(const Eigen::VectorXd& there) {
  if (factor_.size() == 0 || factor_at_ != there || factor_tau_ != tau) {
    factor_ = triangular_factor(problem, there, asked, scale, {tau, LossKind::kNone});
    factor_at_ = there;
    factor_tau_ = tau;
  }
  return factor_;
}

Eigen::MatrixXd FitState::free_factor() {
  const Eigen::MatrixXd& R = asked_factor(theta);
  return triangle(R(Eigen::all, gauge.free));
}

void FitState::bring_to_equilibrium() {
  if (problem.model.needs() != kNothing) {
    settle(problem.model, theta.head(problem.model.parameter_count()), problem.threads, settled_);
    memory_.forget();
    if (response) response->origin = theta;
    forget();
  }
  memory_.prepare(problem.row_count());
}

void FitState::forget() {
  residuals_.resize(0, 0);
  factor_.resize(0, 0);
}

Stepped FitState::step(LossKind with, const std::vector<int>& of, const Eigen::VectorXd& of_scale, const Limits& within,
                       double unjudged) {
  constexpr double kCautious = 4;      // times what the cost says
  constexpr double kQuadratic = 0.01;  // what is left of a step that is not judged
  if (within.lower.size() > 0) return {};
  const Reduced reduced(problem, theta, of, of_scale, {tau, with}, within);
  const Eigen::VectorXd here = Eigen::VectorXd::Zero(reduced.size());
  const NormalEquations& sums = reduced.at(here.data(), true);
  if (!std::isfinite(sums.cost) || !sums.A.allFinite()) return {};
  root_ = root_at(sums);
  root_tau_ = tau;
  const double left = root_->turned.norm();
  const Eigen::VectorXd to = root_->step();
  const Eigen::VectorXd before = theta;
  theta = reduced.theta(to.data());
  if (left <= unjudged) {
    contraction_ = kQuadratic;
    return {true, kQuadratic * left, reduced.of_data()};
  }
  // Were the Hessian H (1 + e), the cost would fall by left^2 (1 - e) / 2 and e left would be left of the step.
  const double promised = 0.5 * left * left;
  const double fell = sums.cost - reduced.cost_of(residuals_here(), to.data());
  if (!(fell >= 0.5 * promised)) {
    theta = before;
    return {};
  }
  contraction_ = kCautious * std::abs(fell / promised - 1);
  return {true, contraction_ * left, reduced.of_data()};
}

bool FitState::step_with_factor(bool noise_is_a_factor) {
  constexpr double kSameFactor = 1e-3;    // standard deviations: beside the arm, nothing
  constexpr double kAtTheMinimum = 1e-7;  // standard deviations
  const CommonNoise& noise = noise_is_a_factor ? root_tau_ : tau;
  Eigen::VectorXd g;
  factor_ = triangular_factor(problem, theta, asked, scale, {noise, loss}, &g);
  double changed = 0;  // the noise since the Hessian was found
  for (std::size_t k = 0; k < tau.size(); ++k) {
    factor_ *= noise[k] / tau[k];
    changed = std::max(changed, std::abs(noise[k] / root_tau_[k] - 1));
  }
  factor_at_ = theta;
  factor_tau_ = tau;
  const Eigen::VectorXd turned = root_->turn(g(gauge.free));
  const double left = turned.norm();
  if (!(left <= kSameFactor && left * (contraction_ + 4 * changed) <= kAtTheMinimum)) return false;
  const Eigen::VectorXd x = root_->step(turned);
  for (std::size_t k = 0; k < free.size(); ++k)
    theta[free[k]] += free_scale[static_cast<Eigen::Index>(k)] * x[static_cast<Eigen::Index>(k)];
  factor_at_ = theta;
  return true;
}

Solution FitState::refit(LossKind with, const SolverOptions& solver) {
  Solution solution = solve(problem, theta, free, free_scale, {tau, with}, limits, solver);
  theta = solution.theta;
  return solution;
}

}  // namespace fastcal
