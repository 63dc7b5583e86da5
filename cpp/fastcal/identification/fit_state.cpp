// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/fit_state.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

constexpr Eigen::Index kGaugeRows = 160;  // by which the gauge is chosen where there are three times as many
constexpr double kHoldUnknown =
    1e-5;  // what an instrument brings along is never nominal: everything else is held first

/// values[indices].
std::vector<int> picked(const std::vector<int>& values, const std::vector<int>& indices) {
  std::vector<int> out;
  out.reserve(indices.size());
  for (const int k : indices) out.push_back(values[static_cast<std::size_t>(k)]);
  return out;
}

/// Column k of M goes to column order[k].
Eigen::MatrixXd columns_back(const Eigen::MatrixXd& M, const std::vector<int>& order) {
  Eigen::MatrixXd out(M.rows(), M.cols());
  for (std::size_t k = 0; k < order.size(); ++k) out.col(order[k]) = M.col(static_cast<Eigen::Index>(k));
  return out;
}

}  // namespace

Eigen::VectorXd at(const Eigen::VectorXd& values, const std::vector<int>& indices) { return values(indices); }

Eigen::MatrixXd triangle(const Eigen::MatrixXd& M) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(M.rowwise().reverse());
  const Eigen::MatrixXd upper = qr.matrixQR().topRows(M.cols()).triangularView<Eigen::Upper>();
  return upper.reverse();
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
              nullptr,        &memory_,
              given.source},
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
  const Eigen::Index few = std::max<Eigen::Index>(kGaugeRows, 4 * static_cast<Eigen::Index>(asked.size()));
  const bool plain = given.model.needs() == kNothing && !has_priors() && limits.pull_sigma.size() == 0 &&
                     limits.lower.size() == 0 && options.solver.method == Method::kLeastSquares && !options.gauge.off;
  if (plain && given.row_count() >= 3 * few) some_ = std::make_unique<ThinnedProblem>(given, few);
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

const RowErrors& FitState::errors_here() {
  if (!errors_ || errors_at_ != theta) {
    errors_.reset();  // before the others come: rows may fill the memory
    errors_.emplace(problem, theta);
    errors_at_ = theta;
  }
  return *errors_;
}

const std::vector<Eigen::Index>& FitState::counts() {
  if (!counts_.empty()) return counts_;
  const auto& observations = problem.measured.observations();
  const RowMatrixXd* points = observations.front()->coordinates();
  if (!errors_ && problem.source == nullptr && observations.size() == 1 && points != nullptr) {
    counts_ = {(points->array() == points->array()).count()};  // no robot is needed to see what is there
    return counts_;
  }
  const RowErrors& rows = errors_here();
  for (int k = 0; k < rows.observation_count(); ++k) counts_.push_back(rows.number_count(k));
  return counts_;
}

void FitState::factorize(const Eigen::VectorXd& there, const Weighting& weighting, double factor,
                         Eigen::VectorXd* slope) {
  order_ = free_first();
  const Eigen::VectorXd sizes = at(scale, order_);
  factor_ = factor * triangular_factor(problem, there, picked(asked, order_), sizes, weighting, slope);
  factor_at_ = there;
  factor_tau_ = tau;
}

std::vector<int> FitState::free_first() const {
  std::vector<int> out(asked.size());
  if (gauge.free.empty() && gauge.held.empty()) {
    std::iota(out.begin(), out.end(), 0);
  } else {
    std::copy(gauge.held.begin(), gauge.held.end(), std::copy(gauge.free.rbegin(), gauge.free.rend(), out.begin()));
  }
  return out;
}

Eigen::MatrixXd FitState::asked_factor(const Eigen::VectorXd& there) {
  if (!is_factorized(there)) factorize(there, {tau, LossKind::kNone}, 1, nullptr);
  return columns_back(factor_, order_);
}

bool FitState::is_factorized_by_gauge() const {
  return std::equal(gauge.free.rbegin(), gauge.free.rend(), order_.begin(), order_.end() - gauge.held.size());
}

Eigen::MatrixXd FitState::free_factor() {
  if (free_factor_.size() > 0 && free_factor_at_ == theta && factor_tau_ == tau) return free_factor_;
  const Eigen::MatrixXd R = asked_factor(theta);
  const auto p = static_cast<Eigen::Index>(gauge.free.size());
  if (is_factorized_by_gauge()) return factor_.topLeftCorner(p, p).reverse();
  return triangle(R(Eigen::all, gauge.free));
}

bool FitState::confirms_gauge(const Eigen::VectorXd& there) {
  if (has_priors() || gauge.free.empty()) return false;
  if (!is_factorized(there)) factorize(there, {tau, LossKind::kNone}, 1, nullptr);
  return is_factorized_by_gauge() &&
         parts_clearly(factor_, static_cast<Eigen::Index>(gauge.free.size()), options.gauge);
}

Eigen::MatrixXd FitState::gauge_factor(const Eigen::VectorXd& there) {
  if (some_ == nullptr) return with_priors(asked_factor(there), asked, scale, options.limits);
  const double share = static_cast<double>(problem.row_count()) / static_cast<double>(some_->problem().row_count());
  return std::sqrt(share) * triangular_factor(some_->problem(), there, asked, scale, {tau, LossKind::kNone});
}

Gauge FitState::gauge_of_some() {
  const double share = static_cast<double>(problem.row_count()) / static_cast<double>(some_->problem().row_count());
  const std::vector<int> order = free_first();
  const Eigen::VectorXd sizes = at(scale, order);
  const Eigen::MatrixXd R = std::sqrt(share) * triangular_factor(some_->problem(), theta, picked(asked, order), sizes,
                                                                 {tau, LossKind::kNone});
  const auto p = static_cast<Eigen::Index>(gauge.free.size());
  const auto lost = static_cast<Eigen::Index>(gauge.held.size());
  if (!parts_clearly(R, p, options.gauge)) return choose_gauge(columns_back(R, order), hold, options.gauge);
  Gauge same = gauge;
  same.rank = static_cast<int>(p);
  Eigen::MatrixXd moved(lost, p + lost);  // transposed
  moved << -solve_upper(R.topLeftCorner(p, p), R.topRightCorner(p, lost)).transpose(),
      Eigen::MatrixXd::Identity(lost, lost);
  same.directions = columns_back(moved, order).transpose();
  return same;
}

bool FitState::factor_by_sums(const CommonNoise& noise, Eigen::VectorXd& g) {
  constexpr double kShowsNothing = 1e-3;  // times what the gauge takes for nothing, so that chance hides no direction
  constexpr double kCondition = 1e4;      // its square times rounding is what Cholesky loses
  const Gauge again = gauge_of_some();
  if (again.free != gauge.free) return false;
  std::vector<int> order = gauge.held;
  order.insert(order.end(), gauge.free.begin(), gauge.free.end());
  // Two mixtures of the directions that are held: where any of them shows, both are blind to it by a rare chance.
  Eigen::MatrixXd directions(static_cast<Eigen::Index>(order.size()), again.held.empty() ? 0 : 2);
  for (Eigen::Index m = 0; m < directions.cols(); ++m) {
    Eigen::VectorXd mixed = Eigen::VectorXd::Zero(directions.rows());
    for (Eigen::Index k = 0; k < again.directions.cols(); ++k)
      mixed += std::cos(1.0 + 3.7 * static_cast<double>(k) + 2.3 * static_cast<double>(m * k * k)) *
               again.directions.col(k).normalized();
    directions.col(m) = mixed(order).normalized();
  }
  const auto p = static_cast<Eigen::Index>(gauge.free.size());
  const PlainSums sums = plain_sums(problem, theta, picked(asked, order), scale(order), {noise, loss}, p, directions);
  const Eigen::VectorXd length = sums.A.diagonal().cwiseSqrt();
  if (!(length.minCoeff() > 0)) return false;
  if (!(std::sqrt(sums.along) <= kShowsNothing * options.gauge.relative_tolerance * length.maxCoeff())) return false;
  const Eigen::MatrixXd scaled = length.cwiseInverse().asDiagonal() * sums.A * length.cwiseInverse().asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> root(Eigen::MatrixXd(scaled.reverse()));
  if (root.info() != Eigen::Success) return false;
  const Eigen::MatrixXd R = root.matrixU().toDenseMatrix().reverse();
  const Eigen::MatrixXd inverse = solve_lower(R, Eigen::MatrixXd::Identity(p, p));
  const double smallest = 1 / (length.cwiseInverse().asDiagonal() * inverse).norm();  // singular value at least
  if (!(inverse.norm() <= kCondition && smallest * options.gauge.practical_limit >= 1)) return false;
  gauge.rank = again.rank;
  g = sums.g;
  free_factor_ = R * length.asDiagonal();
  return true;
}

void FitState::bring_to_equilibrium() {
  if (problem.model.needs() != kNothing) {
    settle(problem.model, theta.head(problem.model.parameter_count()), problem.threads, settled_);
    memory_.forget();
    settled_at_ = theta;
    if (problem.source != nullptr) problem.settled_at = &settled_at_;
    if (response) response->origin = theta;
    forget();
  }
  memory_.prepare(problem.samples.count());
}

void FitState::forget() {
  errors_.reset();
  factor_.resize(0, 0);
  free_factor_.resize(0, 0);
}

Stepped FitState::step(LossKind with, const std::vector<int>& of, const Eigen::VectorXd& of_scale, const Limits& within,
                       double unjudged, bool is_curved) {
  constexpr double kCautious = 4;      // times what the cost says
  constexpr double kQuadratic = 0.01;  // what is left of a step that is not judged
  if (within.lower.size() > 0) return {};
  all_agree_ = false;
  const Eigen::VectorXd before = theta;
  const Reduced reduced(problem, before, of, of_scale, {tau, with, is_curved}, within);
  const Eigen::VectorXd here = Eigen::VectorXd::Zero(reduced.size());
  const NormalEquations& sums = reduced.at(here.data(), true);
  if (!std::isfinite(sums.cost) || !sums.A.allFinite()) return {};
  root_ = root_at(sums);
  root_tau_ = tau;
  const double left = root_->turned.norm();
  const Eigen::VectorXd to = root_->step();
  theta = reduced.theta(to.data());
  if (left <= unjudged) {
    contraction_ = kQuadratic;
    return {true, kQuadratic * left, reduced.of_data()};
  }
  // Were the Hessian H (1 + e), the cost would fall by left^2 (1 - e) / 2 and e left would be left of the step.
  const double promised = 0.5 * left * left;
  const double fell = sums.cost - reduced.cost_of(errors_here(), to.data());
  if (!(fell >= 0.5 * promised)) {
    theta = before;
    return {};
  }
  contraction_ = kCautious * std::abs(fell / promised - 1);
  if (with == LossKind::kHuber) contraction_ = std::max(contraction_, kQuadratic);  // a row that crosses the bend
  return {true, contraction_ * left, reduced.of_data()};
}

bool FitState::step_with_factor(bool noise_is_a_factor) {
  constexpr double kSameFactor = 4e-3;    // standard deviations: beside the arm, nothing
  constexpr double kAtTheMinimum = 1e-7;  // standard deviations
  const CommonNoise& noise = noise_is_a_factor ? root_tau_ : tau;
  Eigen::VectorXd g;
  double scale_of_noise = 1;
  double changed = 0;  // the noise since the Hessian was found
  for (std::size_t k = 0; k < tau.size(); ++k) {
    scale_of_noise *= noise[k] / tau[k];
    changed = std::max(changed, std::abs(noise[k] / root_tau_[k] - 1));
  }
  all_agree_ = some_ != nullptr && factor_by_sums(noise, g);
  if (all_agree_) {
    free_factor_ *= scale_of_noise;
    free_factor_at_ = theta;
    factor_.resize(0, 0);
  } else {
    choose_by_all();
    factorize(theta, {noise, loss}, scale_of_noise, &g);
    g = g.head(static_cast<Eigen::Index>(gauge.free.size())).reverse().eval();
  }
  factor_tau_ = tau;
  const Eigen::VectorXd turned = root_->turn(g);
  const double left = turned.norm();
  if (!(left <= kSameFactor && left * (contraction_ + 4 * changed) <= kAtTheMinimum)) return false;
  const Eigen::VectorXd x = root_->step(turned);
  for (std::size_t k = 0; k < free.size(); ++k)
    theta[free[k]] += free_scale[static_cast<Eigen::Index>(k)] * x[static_cast<Eigen::Index>(k)];
  (all_agree_ ? free_factor_at_ : factor_at_) = theta;
  return true;
}

Solution FitState::refit(LossKind with, const SolverOptions& solver) {
  Solution solution = solve(problem, theta, free, free_scale, {tau, with}, limits, solver);
  theta = solution.theta;
  return solution;
}

}  // namespace fastcal
