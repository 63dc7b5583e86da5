// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Minimizes 1/2 sum rho(u_i^2) + 1/2 |prior|^2 over the free parameters, in x = (theta - theta_0) / scale, with bounds.
// Newton's steps, with the exact second derivative of the robust loss, go first; where one is refused or bounds are in
// the way Ceres' trust region drives. A pass over the rows reduces: Ceres sees p + 1 residuals, r' = L^-1 J^T W r with
// Jacobian L^T (J^T W J = L L^T) and one constant, so that cost, gradient and Gauss-Newton Hessian are those of the
// whole problem.
#pragma once

#include <string>
#include <vector>

#include "fastcal/identification/problem.hpp"

namespace fastcal {

/// Gaussian priors, bounds and pulls on model parameters, indexed as theta; infinite where there are none. A pull is a
/// prior that the solver alone knows: among fits that the data hardly distinguish it chooses one near `pull_mean`, and
/// what is stated of identifiability, freedom and deviations is as without it.
struct Limits {
  Eigen::VectorXd prior_mean, prior_sigma;  ///< both empty: no priors; sigma infinite: none for this one
  Eigen::VectorXd lower, upper;             ///< both empty: no bounds
  Eigen::VectorXd pull_mean, pull_sigma;    ///< both empty: no pulls
};

inline constexpr double kCostTells = 1e-4;  // standard deviations: of shorter steps rounding decides whether they help

enum class Method {
  kLeastSquares,  ///< Newton's steps first; Ceres' trust region where one is refused or bounds are in the way
  kTrustRegion,   ///< Ceres' trust region alone
  kBfgs,  ///< BFGS with line search on the root of the mean (robust) squared whitened distance (PMC paper, section
          ///< III.A)
  kBfgsMeanDistance  ///< the same on the mean distance, the cost that PMC (15) prints
};

/// Sums of squares, which know priors and bounds?
inline bool is_least_squares(Method method) {
  return method == Method::kLeastSquares || method == Method::kTrustRegion;
}

struct SolverOptions {
  Method method = Method::kLeastSquares;
  int max_iterations = 100;
  double settled = 1e-5;  ///< standard deviations at unit noise: a step that is no longer is the last
};

struct Solution {
  Eigen::VectorXd theta;
  bool converged = false;
  int iterations = 0;
  double cost = 0;
  std::string message;
  Eigen::MatrixXd A;  ///< of the normal equations where they were found last, without priors; empty where never
};

/// `free` are the parameters that move, `scale` (one each) their plausible sizes. Others stay at theta_0.
Solution solve(const Problem& problem, const Eigen::VectorXd& theta_0, const std::vector<int>& free,
               const Eigen::VectorXd& scale, const Weighting& weighting, const Limits& limits,
               const SolverOptions& options);

}  // namespace fastcal
