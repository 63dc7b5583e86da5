// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The problem in the free parameters alone, x = (theta - theta_0) / scale, priors included, and the steps that its
// normal equations give.
#pragma once

#include <Eigen/Cholesky>
#include <utility>
#include <vector>

#include "fastcal/identification/row_errors.hpp"
#include "fastcal/identification/solver.hpp"

namespace fastcal {

/// The problem in x, priors included; remembers the last x, since Ceres asks for cost and Jacobian apart. What it is
/// given, but for the weighting, must outlive it and stay.
class Reduced {
 public:
  Reduced(const Problem& problem, const Eigen::VectorXd& theta_0, const std::vector<int>& free,
          const Eigen::VectorXd& scale, Weighting weighting, const Limits& limits)
      : problem_(problem),
        theta_0_(theta_0),
        free_(free),
        scale_(scale),
        weighting_(std::move(weighting)),
        limits_(limits) {}

  Eigen::Index size() const { return static_cast<Eigen::Index>(free_.size()); }

  Eigen::VectorXd theta(const double* x) const;

  const NormalEquations& at(const double* x, bool with_jacobian) const;

  /// Cost at x, which leaves these errors.
  double cost_of(const RowErrors& errors, const double* x) const;

  /// A of the last x without priors; empty where it was not asked for.
  Eigen::MatrixXd of_data() const;

 private:
  /// Calls body(k, u, du / dx_k) for every prior and pull.
  template <typename Body>
  void for_each_gaussian(const Eigen::VectorXd& theta_here, const Body& body) const;

  const Problem& problem_;
  const Eigen::VectorXd& theta_0_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& scale_;
  Weighting weighting_;
  const Limits& limits_;
  mutable bool known_ = false;
  mutable Eigen::VectorXd last_x_;
  mutable NormalEquations last_;
  mutable Eigen::VectorXd of_priors_;  // their part of the diagonal of A
};

/// P^T L D L^T P = S A S, S = diag(A)^-1/2: a parameter that a prior holds to 1e-10 of its size leaves the others their
/// digits. Pivots that are nothing beside 1 are left out.
struct Root {
  Root(const Eigen::MatrixXd& A, const Eigen::VectorXd& g);

  /// D^-1/2 L^-1 P S g of another slope.
  Eigen::VectorXd turn(const Eigen::VectorXd& g) const;

  bool is_positive() const;

  /// To where the quadratic has its minimum.
  Eigen::VectorXd step() const { return step(turned); }
  Eigen::VectorXd step(const Eigen::VectorXd& turned_slope) const;

  /// Of A^-1; 0 for what is left out.
  Eigen::VectorXd inverse_diagonal() const;

  /// R with R^T R = A.
  Eigen::MatrixXd upper() const;

  Eigen::VectorXd scale;
  Eigen::LDLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd diagonal;  // root of D, 0 for what is left out
  Eigen::VectorXd turned;    // D^-1/2 L^-1 P S g: as long as the step, in standard deviations
};

/// Of the Hessian: steps of Newton, which converge quadratically where Gauss-Newton's come nearer by a tenth under a
/// loss that redescends. Far away, where the Hessian is not positive or its quadratic lies below zero, that of Gauss
/// and Newton.
Root root_at(const NormalEquations& sums);

/// Length of the Gauss-Newton step that is left at x, in standard deviations at whitened noise 1.
double step_left(const Reduced& reduced, const double* x);

}  // namespace fastcal
