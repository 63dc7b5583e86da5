// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/solver.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace fastcal {
namespace {

/// The problem in x, priors included; remembers the last x, since Ceres asks for cost and Jacobian apart.
class Reduced {
 public:
  Reduced(const Problem& problem, const Eigen::VectorXd& theta_0, const std::vector<int>& free,
          const Eigen::VectorXd& scale, const Weighting& weighting, const Limits& limits)
      : problem_(problem), theta_0_(theta_0), free_(free), scale_(scale), weighting_(weighting), limits_(limits) {}

  Eigen::Index size() const { return static_cast<Eigen::Index>(free_.size()); }

  Eigen::VectorXd theta(const double* x) const {
    Eigen::VectorXd out = theta_0_;
    for (Eigen::Index k = 0; k < size(); ++k) out[free_[static_cast<std::size_t>(k)]] += scale_[k] * x[k];
    return out;
  }

  const NormalEquations& at(const double* x, bool with_jacobian) const {
    const Eigen::Map<const Eigen::VectorXd> here(x, size());
    if (known_ && last_x_ == here && (!with_jacobian || last_.A.size() > 0 || size() == 0)) return last_;
    const Eigen::VectorXd theta_here = theta(x);
    last_ = normal_equations(problem_, theta_here, free_, scale_, weighting_, with_jacobian);
    of_priors_ = Eigen::VectorXd::Zero(size());
    add(limits_.prior_mean, limits_.prior_sigma, theta_here, with_jacobian);
    add(limits_.pull_mean, limits_.pull_sigma, theta_here, with_jacobian);
    last_x_ = here;
    known_ = true;
    return last_;
  }

  /// A of the last x with the data's part as flat as the robust cost is on average: steps of Newton, not Gauss-Newton,
  /// which come nearer by a tenth only where a loss redescends.
  Eigen::MatrixXd hessian() const {
    Eigen::MatrixXd out = last_.bend * last_.A;
    out.diagonal() += (1 - last_.bend) * of_priors_;
    return out;
  }

 private:
  /// A Gaussian's part of the sums.
  void add(const Eigen::VectorXd& mean, const Eigen::VectorXd& sigma, const Eigen::VectorXd& theta_here,
           bool with_jacobian) const {
    for (Eigen::Index k = 0; sigma.size() > 0 && k < size(); ++k) {
      const int index = free_[static_cast<std::size_t>(k)];
      if (!std::isfinite(sigma[index])) continue;
      const double u = (theta_here[index] - mean[index]) / sigma[index];
      const double slope = scale_[k] / sigma[index];
      last_.cost += 0.5 * u * u;
      if (with_jacobian) {
        last_.A(k, k) += slope * slope;
        of_priors_[k] += slope * slope;
        last_.g[k] += slope * u;
      }
    }
  }

  const Problem& problem_;
  const Eigen::VectorXd& theta_0_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& scale_;
  const Weighting& weighting_;
  const Limits& limits_;
  mutable bool known_ = false;
  mutable Eigen::VectorXd last_x_;
  mutable NormalEquations last_;
  mutable Eigen::VectorXd of_priors_;  // their part of the diagonal of A
};

/// P^T L D L^T P = A; pivots that are nothing beside the largest are left out.
struct Root {
  Root(const Eigen::MatrixXd& A, const Eigen::VectorXd& g) : factor(A), turned(factor.transpositionsP() * g) {
    const double floor = 1e-13 * std::max(factor.vectorD().maxCoeff(), 0.0);
    diagonal = factor.vectorD().unaryExpr([floor](double d) { return d > floor ? std::sqrt(d) : 0.0; });
    factor.matrixL().solveInPlace(turned);
    turned = (diagonal.array() > 0).select(turned.array() / diagonal.array(), 0);
  }

  /// To where the quadratic has its minimum.
  Eigen::VectorXd step() const {
    Eigen::VectorXd x = (diagonal.array() > 0).select(-turned.array() / diagonal.array(), 0);
    factor.matrixU().solveInPlace(x);
    return factor.transpositionsP().transpose() * x;
  }

  Eigen::LDLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd diagonal;  // root of D, 0 for what is left out
  Eigen::VectorXd turned;    // D^-1/2 L^-1 P g: as long as the step, in standard deviations
};

/// At the last x; far away, where the flatter quadratic would lie below zero, that of Gauss and Newton.
Root root_at(const Reduced& reduced, const NormalEquations& sums) {
  if (sums.bend < 1) {
    Root flat(reduced.hessian(), sums.g);
    if (flat.turned.squaredNorm() < sums.cost) return flat;
  }
  return {sums.A, sums.g};
}

/// The root of the normal equations as a Ceres cost function.
class RootCost : public ceres::CostFunction {
 public:
  explicit RootCost(const Reduced& reduced) : reduced_(reduced) {
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
    const Root root = root_at(reduced_, sums);
    left_ = root.turned.squaredNorm();
    Eigen::Map<Eigen::VectorXd>(r, p) = root.turned;
    r[p] = std::sqrt(std::max(0.0, 2 * sums.cost - left_));
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMatrixXd> J(jacobians[0], p + 1, p);
      const Eigen::MatrixXd L = root.factor.matrixL();
      J.topRows(p) = (root.factor.transpositionsP().transpose() * (L * root.diagonal.asDiagonal()).eval()).transpose();
      J.row(p).setZero();
    }
    return true;
  }

  /// Squared length of the Gauss-Newton step from where it was evaluated last, in standard deviations at unit noise.
  double left() const { return left_; }

 private:
  const Reduced& reduced_;
  mutable double left_ = 0;
};

/// Ends the search where the step that is left is too short for the cost to tell: beyond, rounding accepts and refuses.
class NothingLeft : public ceres::IterationCallback {
 public:
  NothingLeft(const RootCost& cost, double settled) : cost_(cost), settled_(settled) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    reached_ = summary.step_is_successful && cost_.left() <= settled_ * settled_;
    return reached_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool reached() const { return reached_; }

 private:
  const RootCost& cost_;
  double settled_;
  bool reached_ = false;
};

/// The cost of the PMC paper as a function of y, x = T y: the root of the mean squared whitened distance, or with
/// LossKind::kDistance the mean distance. T makes the Hessian nearly the identity at the start: BFGS with a well chosen
/// first H instead of H = I (its step 1: "in the absence of more information").
class MeanCost : public ceres::FirstOrderFunction {
 public:
  MeanCost(const Reduced& reduced, Eigen::MatrixXd transform, double rows, bool of_distance)
      : reduced_(reduced), transform_(std::move(transform)), rows_(rows), of_distance_(of_distance) {}

  bool Evaluate(const double* y, double* cost, double* gradient) const override {
    const Eigen::VectorXd x = transform_ * Eigen::Map<const Eigen::VectorXd>(y, transform_.cols());
    const NormalEquations& sums = reduced_.at(x.data(), true);
    if (!std::isfinite(sums.cost)) return false;
    const double root = std::sqrt(2 * sums.cost / rows_);
    *cost = of_distance_ ? sums.cost / rows_ : root;
    if (gradient != nullptr) {
      const double factor = 1 / (of_distance_ ? rows_ : rows_ * std::max(root, 1e-300));
      Eigen::Map<Eigen::VectorXd>(gradient, transform_.cols()) = factor * (transform_.transpose() * sums.g);
    }
    return true;
  }
  int NumParameters() const override { return static_cast<int>(transform_.cols()); }

 private:
  const Reduced& reduced_;
  Eigen::MatrixXd transform_;
  double rows_;
  bool of_distance_;
};

/// Length of the Gauss-Newton step that is left at x, in standard deviations at whitened noise 1.
double step_left(const Reduced& reduced, const double* x) {
  const NormalEquations& sums = reduced.at(x, true);
  return std::sqrt(std::abs(sums.g.dot(sums.A.completeOrthogonalDecomposition().solve(sums.g))));
}

void solve_least_squares(const Reduced& reduced, const std::vector<int>& free, const Eigen::VectorXd& theta_0,
                         const Eigen::VectorXd& scale, const Limits& limits, const SolverOptions& asked,
                         Eigen::VectorXd& x, Solution& out) {
  RootCost cost(reduced);
  NothingLeft nothing_left(cost, asked.settled);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  problem.AddResidualBlock(&cost, nullptr, x.data());
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Eigen::ArrayXd low = Eigen::ArrayXd::Constant(x.size(), -kFar);
  Eigen::ArrayXd high = Eigen::ArrayXd::Constant(x.size(), kFar);
  for (Eigen::Index k = 0; limits.lower.size() > 0 && k < x.size(); ++k) {
    const int index = free[static_cast<std::size_t>(k)];
    low[k] = (limits.lower[index] - theta_0[index]) / scale[k];
    high[k] = (limits.upper[index] - theta_0[index]) / scale[k];
    x[k] = std::clamp(x[k], low[k], high[k]);  // Ceres refuses a start outside
    if (std::isfinite(low[k])) problem.SetParameterLowerBound(x.data(), static_cast<int>(k), low[k]);
    if (std::isfinite(high[k])) problem.SetParameterUpperBound(x.data(), static_cast<int>(k), high[k]);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = asked.max_iterations;
  options.callbacks.push_back(&nothing_left);
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-11;
  options.initial_trust_region_radius = 1e8;  // the start is close: first try the full step
  options.max_trust_region_radius = 1e20;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  out.iterations = static_cast<int>(summary.iterations.size());
  const NormalEquations& end = reduced.at(x.data(), true);
  out.cost = end.cost;
  const Root root = root_at(reduced, end);
  const Eigen::VectorXd last = x + root.step();
  if (nothing_left.reached() && (last.array() >= low).all() && (last.array() <= high).all()) {
    x = last;
    out.cost -= 0.5 * root.turned.squaredNorm();
  }
  // A robust loss converges step by step where many parameters meet outliers: the step that is left decides, not how
  // many there were.
  constexpr double kNothingLeft = 1e-3;  // standard deviations
  const bool ended = summary.termination_type == ceres::NO_CONVERGENCE;
  const bool near = nothing_left.reached() || (ended && step_left(reduced, x.data()) < kNothingLeft);
  out.converged = near || summary.termination_type == ceres::CONVERGENCE;
  out.message =
      near ? "the step that is left is below " + std::string(ended ? "0.001" : "0.00001") + " standard deviations"
           : summary.message;
}

void solve_bfgs(const Reduced& reduced, double rows, bool of_distance, int max_iterations, Eigen::VectorXd& x,
                Solution& out) {
  const NormalEquations& start = reduced.at(x.data(), true);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(start.A);
  const double floor = 1e-13 * std::max(eigen.eigenvalues().tail<1>()[0], 1e-300);
  const Eigen::VectorXd stretch =
      eigen.eigenvalues().unaryExpr([floor](double d) { return 1 / std::sqrt(std::max(d, floor)); });
  const Eigen::MatrixXd transform = eigen.eigenvectors() * stretch.asDiagonal();
  ceres::GradientProblem problem(new MeanCost(reduced, transform, rows, of_distance));
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::BFGS;
  options.line_search_type = ceres::WOLFE;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 0;
  options.gradient_tolerance = 1e-16;
  options.parameter_tolerance = 0;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  Eigen::VectorXd y = eigen.eigenvectors().transpose() * x;
  y = y.cwiseQuotient(stretch);
  ceres::Solve(options, problem, y.data(), &summary);
  x = transform * y;
  out.iterations = static_cast<int>(summary.iterations.size());
  // It ends where the cost no longer changes in double precision, which Ceres reports as a failed line search: judged
  // by the step that is left.
  const double left = step_left(reduced, x.data());
  out.cost = reduced.at(x.data(), true).cost;
  out.converged = left < 1e-4 * std::sqrt(1 + 2 * out.cost);
  out.message = "BFGS: " + summary.message;
}

/// Near an active bound Ceres converges slowly. The parameters that the cost pushes against theirs stay there, the
/// others are solved for anew.
void solve_inside(const Problem& problem, const Reduced& reduced, const std::vector<int>& free,
                  const Eigen::VectorXd& scale, const Weighting& weighting, const Limits& limits,
                  const SolverOptions& options, Eigen::VectorXd& x, Solution& out) {
  if (limits.lower.size() == 0) return;
  Eigen::VectorXd theta = reduced.theta(x.data());
  const Eigen::VectorXd slope = reduced.at(x.data(), true).g;
  std::vector<int> inside;
  std::vector<double> inside_scale;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double bound = slope[i] > 0 ? limits.lower[free[k]] : limits.upper[free[k]];
    if (std::abs(theta[free[k]] - bound) <= 1e-9 * scale[i]) {
      theta[free[k]] = bound;
    } else {
      inside.push_back(free[k]);
      inside_scale.push_back(scale[i]);
    }
  }
  if (inside.size() == free.size()) return;
  const Solution rest =
      solve(problem, theta, inside,
            Eigen::Map<const Eigen::VectorXd>(inside_scale.data(), static_cast<Eigen::Index>(inside.size())), weighting,
            limits, options);
  const Eigen::VectorXd start = reduced.theta(Eigen::VectorXd::Zero(x.size()).eval().data());
  for (std::size_t k = 0; k < free.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    x[i] = (rest.theta[free[k]] - start[free[k]]) / scale[i];
  }
  out.cost = rest.cost;
  out.converged = rest.converged;
  out.iterations += rest.iterations;
  out.message = rest.message;
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
  } else if (options.method == Method::kLeastSquares) {
    solve_least_squares(reduced, free, theta_0, scale, limits, options, x, out);
    solve_inside(problem, reduced, free, scale, weighting, limits, options, x, out);
  } else {
    solve_bfgs(reduced, static_cast<double>(problem.row_count()), options.method == Method::kBfgsMeanDistance,
               options.max_iterations, x, out);
  }
  out.theta = reduced.theta(x.data());
  return out;
}

}  // namespace fastcal
