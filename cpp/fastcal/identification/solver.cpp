// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/solver.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "fastcal/identification/bfgs.hpp"
#include "fastcal/identification/reduced_problem.hpp"

namespace fastcal {
namespace {

/// Bounds in x, and which parameters they hold.
struct Box {
  Box(const Limits& limits, const std::vector<int>& free, const Eigen::VectorXd& theta_0, const Eigen::VectorXd& scale)
      : low(Eigen::ArrayXd::Constant(scale.size(), -kFar)), high(Eigen::ArrayXd::Constant(scale.size(), kFar)) {
    for (Eigen::Index k = 0; limits.lower.size() > 0 && k < scale.size(); ++k) {
      const int index = free[static_cast<std::size_t>(k)];
      low[k] = (limits.lower[index] - theta_0[index]) / scale[k];
      high[k] = (limits.upper[index] - theta_0[index]) / scale[k];
    }
  }

  bool bounds() const { return low.isFinite().any() || high.isFinite().any(); }
  bool contains(const Eigen::VectorXd& x) const { return (x.array() >= low).all() && (x.array() <= high).all(); }

  /// Those that are at a bound (to rounding) beyond which the cost would fall; g its slope.
  std::vector<bool> active(const Eigen::VectorXd& x, const Eigen::VectorXd& g) const {
    constexpr double kAt = 1e-9;  // plausible sizes
    std::vector<bool> out(static_cast<std::size_t>(x.size()));
    for (Eigen::Index k = 0; k < x.size(); ++k)
      out[static_cast<std::size_t>(k)] = (g[k] > 0 && x[k] <= low[k] + kAt) || (g[k] < 0 && x[k] >= high[k] - kAt);
    return out;
  }

  static constexpr double kFar = std::numeric_limits<double>::infinity();
  Eigen::ArrayXd low, high;
};

/// The root of the normal equations as a Ceres cost function.
class RootCost : public ceres::CostFunction {
 public:
  RootCost(const Reduced& reduced, const Box& box) : reduced_(reduced), box_(box) {
    const int p = static_cast<int>(reduced.size());
    set_num_residuals(p + 1);
    mutable_parameter_block_sizes()->push_back(p);
  }

  bool Evaluate(double const* const* parameters, double* r, double** jacobians) const override {
    // Cost alone is asked for at trial points; the root needs A, so it is formed there too and kept for the Jacobian
    // that follows a good step.
    const NormalEquations& sums = reduced_.at(parameters[0], true);
    if (!std::isfinite(sums.cost) || !sums.A.allFinite()) return false;
    const Eigen::Index p = reduced_.size();
    const Root root = root_at(sums);
    left_ = root.turned.squaredNorm();
    active_ = box_.active(Eigen::Map<const Eigen::VectorXd>(parameters[0], p), sums.g);
    Eigen::Map<Eigen::VectorXd>(r, p) = root.turned;
    r[p] = std::sqrt(std::max(0.0, 2 * sums.cost - left_));
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMatrixXd> J(jacobians[0], p + 1, p);
      J.topRows(p) = root.upper();
      J.row(p).setZero();
    }
    return true;
  }

  /// Squared length of the Gauss-Newton step from where it was evaluated last, in standard deviations at unit noise.
  double left() const { return left_; }
  /// The parameters that were held by a bound there.
  const std::vector<bool>& active() const { return active_; }

 private:
  const Reduced& reduced_;
  const Box& box_;
  mutable double left_ = 0;
  mutable std::vector<bool> active_;
};

/// Ends the search where the step that is left is too short for the cost to show: beyond, rounding accepts and refuses.
/// Ends it too where two good steps left the same parameters at their bounds: along active bounds Ceres creeps, and
/// solve_within() holds them.
class Ending : public ceres::IterationCallback {
 public:
  Ending(const RootCost& cost, double settled) : cost_(cost), settled_(settled) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (!summary.step_is_successful) return ceres::SOLVER_CONTINUE;
    settled_here_ = cost_.left() <= settled_ * settled_;
    bounded_ = cost_.active() == before_ && std::count(before_.begin(), before_.end(), true) > 0;
    before_ = cost_.active();
    return settled_here_ || bounded_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool settled() const { return settled_here_; }
  bool bounded() const { return bounded_; }

 private:
  const RootCost& cost_;
  double settled_;
  std::vector<bool> before_;
  bool settled_here_ = false, bounded_ = false;
};

/// Steps of Newton from where the cost is too flat to judge them, each shorter than half of the one before, until one
/// is no longer than `settled`; the cost at the end.
double take_last_steps(const Reduced& reduced, const Box& box, double settled, Eigen::VectorXd& x) {
  constexpr int kMaxLastSteps = 30;
  double cost = 0;
  double before = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kMaxLastSteps; ++k) {
    const NormalEquations& sums = reduced.at(x.data(), true);
    const Root root = root_at(sums);
    const double left = root.turned.norm();
    const Eigen::VectorXd to = x + root.step();
    cost = sums.cost;
    if (!(left < 0.5 * before) || !box.contains(to)) break;
    x = to;
    cost -= 0.5 * left * left;
    if (left <= settled) break;
    before = left;
  }
  return cost;
}

/// How steps of Newton ended: the step that is left is short enough, the next one was refused, or there were too many.
enum class Descent { kSettled, kRefused, kSpent };

/// Steps of Newton from x while each takes at least half of what its quadratic promises from the cost and stays in the
/// box, at most `most`, until the step that is left is no longer than `settled`.
Descent descend(const Reduced& reduced, const Box& box, double settled, int most, Eigen::VectorXd& x, int& iterations) {
  for (int k = 0;; ++k, ++iterations) {
    const NormalEquations& sums = reduced.at(x.data(), true);
    if (!std::isfinite(sums.cost) || !sums.A.allFinite()) return Descent::kRefused;
    const Root root = root_at(sums);
    const double left = root.turned.norm();
    if (left <= settled) return Descent::kSettled;
    if (k == most) return Descent::kSpent;
    const Eigen::VectorXd to = x + root.step();
    if (!box.contains(to)) return Descent::kRefused;
    const double cost = sums.cost;
    if (!(cost - reduced.at(to.data(), true).cost >= 0.25 * left * left)) return Descent::kRefused;
    x = to;
  }
}

/// Ceres' trust region from x within the box, for what steps of Newton do not settle; true where it ended early at
/// active bounds.
bool trust_region(const Reduced& reduced, const Box& box, double settled, int most, Eigen::VectorXd& x,
                  ceres::Solver::Summary& summary, bool& is_settled) {
  RootCost cost(reduced, box);
  Ending ending(cost, settled);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  problem.AddResidualBlock(&cost, nullptr, x.data());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (std::isfinite(box.low[k])) problem.SetParameterLowerBound(x.data(), static_cast<int>(k), box.low[k]);
    if (std::isfinite(box.high[k])) problem.SetParameterUpperBound(x.data(), static_cast<int>(k), box.high[k]);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = most;
  options.callbacks.push_back(&ending);
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-11;
  options.initial_trust_region_radius = 1e8;  // the start is close: first try the full step
  options.max_trust_region_radius = 1e20;
  options.logging_type = ceres::SILENT;
  ceres::Solve(options, &problem, &summary);
  is_settled = ending.settled();
  return !is_settled && ending.bounded();
}

/// From x within the box; true where the search ended early at active bounds.
bool solve_least_squares(const Reduced& reduced, const Box& box, const SolverOptions& asked, Eigen::VectorXd& x,
                         Solution& out) {
  const double settled = std::max(asked.settled, kCostTells);
  x = x.array().max(box.low).min(box.high);  // Ceres refuses a start outside
  int taken = 0;
  const bool is_ceres_alone = asked.method == Method::kTrustRegion;
  const Descent descent =
      is_ceres_alone ? Descent::kRefused : descend(reduced, box, settled, asked.max_iterations, x, taken);
  out.iterations += taken + (is_ceres_alone ? 0 : 1);
  bool is_settled = descent == Descent::kSettled;
  ceres::Solver::Summary summary;
  if (descent == Descent::kRefused) {
    const bool bounded = trust_region(reduced, box, settled, asked.max_iterations - taken, x, summary, is_settled);
    out.iterations += static_cast<int>(summary.iterations.size());
    if (bounded) return true;
  }
  // A robust loss converges step by step where many parameters meet outliers: the step that is left decides, not how
  // many there were.
  constexpr double kNothingLeft = 1e-3;  // standard deviations
  const bool near = is_settled || step_left(reduced, x.data()) < kNothingLeft;
  out.cost =
      near && !is_ceres_alone ? take_last_steps(reduced, box, asked.settled, x) : reduced.at(x.data(), true).cost;
  out.converged = near || summary.termination_type == ceres::CONVERGENCE;
  if (near) {
    out.message =
        "converged: the next step is below " + std::string(is_settled ? "0.0001" : "0.001") + " standard deviations";
  } else {
    out.message =
        descent == Descent::kSpent ? "no convergence in " + std::to_string(taken) + " iterations" : summary.message;
  }
  return false;
}

/// Bounds by an active set: parameters at a bound beyond which the cost would fall are held there and the others solved
/// for, until none that is held would rather come back (J. Nocedal, S. Wright, "Numerical Optimization" 2006, 16.5).
void solve_within(const Reduced& whole, const Problem& problem, const std::vector<int>& free,
                  const Eigen::VectorXd& scale, const Weighting& weighting, const Limits& limits,
                  const SolverOptions& options, Eigen::VectorXd& x, Solution& out) {
  constexpr int kMaxSets = 30;
  const Eigen::VectorXd theta_0 = whole.theta(x.data());
  const Box box(limits, free, theta_0, scale);
  x = x.array().max(box.low).min(box.high);
  std::vector<bool> held = box.bounds() ? box.active(x, whole.at(x.data(), true).g) : std::vector<bool>(free.size());
  for (int round = 0; round < kMaxSets; ++round) {
    if (std::find(held.begin(), held.end(), true) == held.end()) {
      if (!solve_least_squares(whole, box, options, x, out)) return;
    } else {
      std::vector<int> inside, moving;
      for (std::size_t k = 0; k < free.size(); ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        if (held[k]) {
          x[i] = x[i] - box.low[i] < box.high[i] - x[i] ? box.low[i] : box.high[i];
        } else {
          inside.push_back(static_cast<int>(k));
          moving.push_back(free[k]);
        }
      }
      const Eigen::VectorXd there = whole.theta(x.data());
      const Eigen::VectorXd moving_scale = scale(inside);
      const Reduced part(problem, there, moving, moving_scale, weighting, limits);
      const Box part_box(limits, moving, there, moving_scale);
      Eigen::VectorXd step = Eigen::VectorXd::Zero(moving_scale.size());
      const bool bounded = !moving.empty() && solve_least_squares(part, part_box, options, step, out);
      x(inside) += step;
      if (!bounded && box.active(x, whole.at(x.data(), true).g) == held) return;
    }
    held = box.active(x, whole.at(x.data(), true).g);
  }
  out.converged = false;
  out.message = "the parameters at their bounds did not settle in " + std::to_string(kMaxSets) + " rounds";
}

}  // namespace

Solution solve(const Problem& problem, const Eigen::VectorXd& theta_0, const std::vector<int>& free,
               const Eigen::VectorXd& scale, const Weighting& weighting, const Limits& limits,
               const SolverOptions& options) {
  Solution out;
  Weighting used = weighting;
  if (options.method == Method::kBfgsMeanDistance) used.loss = LossKind::kDistance;
  const Reduced reduced(problem, theta_0, free, scale, used, limits);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(reduced.size());
  if (free.empty()) {
    out.cost = reduced.at(x.data(), false).cost;
    out.converged = true;
    out.message = "nothing to identify";
  } else if (is_least_squares(options.method)) {
    solve_within(reduced, problem, free, scale, used, limits, options, x, out);
  } else {
    solve_bfgs(reduced, static_cast<double>(problem.row_count()), options.method == Method::kBfgsMeanDistance,
               options.max_iterations, x, out);
  }
  out.theta = reduced.theta(x.data());
  out.A = reduced.of_data();
  return out;
}

}  // namespace fastcal
