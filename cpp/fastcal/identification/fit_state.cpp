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

const Eigen::MatrixXd& FitState::asked_factor(const Eigen::VectorXd& there) {
  if (factor_.size() == 0 || factor_at_ != there || factor_tau_ != tau) {
    factor_ = triangular_factor(problem, there, asked, scale, tau, nullptr);
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
  }
  memory_.prepare(problem.row_count());
  if (response) response->origin = theta;
  forget();
}

void FitState::forget() {
  residuals_.resize(0, 0);
  factor_.resize(0, 0);
}

Solution FitState::refit(LossKind with, const SolverOptions& solver) {
  Solution solution = solve(problem, theta, free, free_scale, {tau, with}, limits, solver);
  theta = solution.theta;
  return solution;
}

}  // namespace fastcal
