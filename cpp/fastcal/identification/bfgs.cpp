// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/bfgs.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

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

}  // namespace

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

}  // namespace fastcal
