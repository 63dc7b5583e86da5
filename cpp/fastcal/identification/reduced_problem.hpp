// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The problem in the free parameters alone, x = (theta - theta_0) / scale, priors included, and the steps that its
// normal equations give.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
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
    for_each_gaussian(theta_here, [&](Eigen::Index k, double u, double slope) {
      last_.cost += 0.5 * u * u;
      if (!with_jacobian) return;
      last_.A(k, k) += slope * slope;
      of_priors_[k] += slope * slope;
      last_.g[k] += slope * u;
    });
    last_x_ = here;
    known_ = true;
    return last_;
  }

  /// Cost at x, which leaves these errors.
  double cost_of(const RowErrors& errors, const double* x) const {
    const Eigen::VectorXd theta_here = theta(x);
    double cost = errors.cost(weighting_);
    for_each_gaussian(theta_here, [&](Eigen::Index, double u, double) { cost += 0.5 * u * u; });
    return cost;
  }

  /// A of the last x without priors; empty where it was not asked for.
  Eigen::MatrixXd of_data() const {
    Eigen::MatrixXd out = last_.A;
    if (out.size() > 0) out.diagonal() -= of_priors_;
    return out;
  }

 private:
  /// Calls body(k, u, du / dx_k) for every prior and pull.
  template <typename Body>
  void for_each_gaussian(const Eigen::VectorXd& theta_here, const Body& body) const {
    const auto each = [&](const Eigen::VectorXd& mean, const Eigen::VectorXd& sigma) {
      for (Eigen::Index k = 0; sigma.size() > 0 && k < size(); ++k) {
        const int index = free_[static_cast<std::size_t>(k)];
        if (std::isfinite(sigma[index]))
          body(k, (theta_here[index] - mean[index]) / sigma[index], scale_[k] / sigma[index]);
      }
    };
    each(limits_.prior_mean, limits_.prior_sigma);
    each(limits_.pull_mean, limits_.pull_sigma);
  }

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
  Root(const Eigen::MatrixXd& A, const Eigen::VectorXd& g) : scale(g.size()) {
    for (Eigen::Index k = 0; k < g.size(); ++k) scale[k] = A(k, k) > 0 ? 1 / std::sqrt(A(k, k)) : 1.0;
    const Eigen::MatrixXd scaled = scale.asDiagonal() * A * scale.asDiagonal();
    factor.compute(scaled);
    constexpr double kFloor = 1e-13;
    diagonal = factor.vectorD().unaryExpr([](double d) { return d > kFloor ? std::sqrt(d) : 0.0; });
    turned = turn(g);
  }

  /// D^-1/2 L^-1 P S g of another slope.
  Eigen::VectorXd turn(const Eigen::VectorXd& g) const {
    Eigen::VectorXd out = factor.transpositionsP() * scale.cwiseProduct(g);
    factor.matrixL().solveInPlace(out);
    return (diagonal.array() > 0).select(out.array() / diagonal.array(), 0);
  }

  bool is_positive() const { return (diagonal.array() > 0).all(); }

  /// To where the quadratic has its minimum.
  Eigen::VectorXd step() const { return step(turned); }
  Eigen::VectorXd step(const Eigen::VectorXd& turned_slope) const {
    Eigen::VectorXd x = (diagonal.array() > 0).select(-turned_slope.array() / diagonal.array(), 0);
    factor.matrixU().solveInPlace(x);
    Eigen::VectorXd out = factor.transpositionsP().transpose() * x;
    out.array() *= scale.array();
    return out;
  }

  /// Of A^-1; 0 for what is left out.
  Eigen::VectorXd inverse_diagonal() const {
    const Eigen::Index p = scale.size();
    const Eigen::MatrixXd L = factor.matrixL();
    Eigen::MatrixXd inverse = L.triangularView<Eigen::UnitLower>().solve(Eigen::MatrixXd::Identity(p, p));
    for (Eigen::Index k = 0; k < p; ++k) inverse.row(k) *= diagonal[k] > 0 ? 1 / diagonal[k] : 0;
    const Eigen::VectorXd squares = inverse.colwise().squaredNorm().transpose();
    const Eigen::VectorXd unpivoted = factor.transpositionsP().transpose() * squares;
    return unpivoted.cwiseProduct(scale.cwiseAbs2());
  }

  /// R with R^T R = A.
  Eigen::MatrixXd upper() const {
    const Eigen::MatrixXd L = factor.matrixL();
    const Eigen::MatrixXd unpivoted = factor.transpositionsP().transpose() * (L * diagonal.asDiagonal()).eval();
    return unpivoted.transpose() * scale.cwiseInverse().asDiagonal();
  }

  Eigen::VectorXd scale;
  Eigen::LDLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd diagonal;  // root of D, 0 for what is left out
  Eigen::VectorXd turned;    // D^-1/2 L^-1 P S g: as long as the step, in standard deviations
};

/// Of the Hessian: steps of Newton, which converge quadratically where Gauss-Newton's come nearer by a tenth under a
/// loss that redescends. Far away, where the Hessian is not positive or its quadratic lies below zero, that of Gauss
/// and Newton.
inline Root root_at(const NormalEquations& sums) {
  if (sums.flattening.size() > 0) {
    Root flat(sums.A - sums.flattening, sums.g);
    if (flat.is_positive() && flat.turned.squaredNorm() < sums.cost) return flat;
  }
  return {sums.A, sums.g};
}

/// Length of the Gauss-Newton step that is left at x, in standard deviations at whitened noise 1.
inline double step_left(const Reduced& reduced, const double* x) {
  const NormalEquations& sums = reduced.at(x, true);
  return Root(sums.A, sums.g).turned.norm();
}

}  // namespace fastcal
