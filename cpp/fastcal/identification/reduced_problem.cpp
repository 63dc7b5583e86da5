// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/reduced_problem.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/decompositions.hpp"

namespace fastcal {

template <typename Body>
void Reduced::for_each_gaussian(const Eigen::VectorXd& theta_here, const Body& body) const {
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

Eigen::VectorXd Reduced::theta(const double* x) const {
  Eigen::VectorXd out = theta_0_;
  for (Eigen::Index k = 0; k < size(); ++k) out[free_[static_cast<std::size_t>(k)]] += scale_[k] * x[k];
  return out;
}

const NormalEquations& Reduced::at(const double* x, bool with_jacobian) const {
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

double Reduced::cost_of(const RowErrors& errors, const double* x) const {
  const Eigen::VectorXd theta_here = theta(x);
  double cost = errors.cost(weighting_);
  for_each_gaussian(theta_here, [&](Eigen::Index, double u, double) { cost += 0.5 * u * u; });
  return cost;
}

Eigen::MatrixXd Reduced::of_data() const {
  Eigen::MatrixXd out = last_.A;
  if (out.size() > 0) out.diagonal() -= of_priors_;
  return out;
}

Root::Root(const Eigen::MatrixXd& A, const Eigen::VectorXd& g) : scale(g.size()) {
  for (Eigen::Index k = 0; k < g.size(); ++k) scale[k] = A(k, k) > 0 ? 1 / std::sqrt(A(k, k)) : 1.0;
  const Eigen::MatrixXd scaled = scale.asDiagonal() * A * scale.asDiagonal();
  factor.compute(scaled);
  constexpr double kFloor = 1e-13;
  diagonal = factor.vectorD().unaryExpr([](double d) { return d > kFloor ? std::sqrt(d) : 0.0; });
  turned = turn(g);
}

Eigen::VectorXd Root::turn(const Eigen::VectorXd& g) const {
  Eigen::VectorXd out = factor.transpositionsP() * scale.cwiseProduct(g);
  factor.matrixL().solveInPlace(out);
  return (diagonal.array() > 0).select(out.array() / diagonal.array(), 0);
}

bool Root::is_positive() const { return (diagonal.array() > 0).all(); }

Eigen::VectorXd Root::step(const Eigen::VectorXd& turned_slope) const {
  Eigen::VectorXd x = (diagonal.array() > 0).select(-turned_slope.array() / diagonal.array(), 0);
  factor.matrixU().solveInPlace(x);
  Eigen::VectorXd out = factor.transpositionsP().transpose() * x;
  out.array() *= scale.array();
  return out;
}

Eigen::VectorXd Root::inverse_diagonal() const {
  const Eigen::Index p = scale.size();
  const Eigen::MatrixXd L = factor.matrixL();
  Eigen::MatrixXd inverse = L.triangularView<Eigen::UnitLower>().solve(Eigen::MatrixXd::Identity(p, p));
  for (Eigen::Index k = 0; k < p; ++k) inverse.row(k) *= diagonal[k] > 0 ? 1 / diagonal[k] : 0;
  const Eigen::VectorXd squares = inverse.colwise().squaredNorm().transpose();
  const Eigen::VectorXd unpivoted = factor.transpositionsP().transpose() * squares;
  return unpivoted.cwiseProduct(scale.cwiseAbs2());
}

Eigen::MatrixXd Root::upper() const {
  const Eigen::MatrixXd L = factor.matrixL();
  const Eigen::MatrixXd unpivoted = factor.transpositionsP().transpose() * (L * diagonal.asDiagonal()).eval();
  return unpivoted.transpose() * scale.cwiseInverse().asDiagonal();
}

Root root_at(const NormalEquations& sums) {
  if (sums.flattening.size() > 0) {
    Root flat(sums.A - sums.flattening, sums.g);
    if (flat.is_positive() && flat.turned.squaredNorm() < sums.cost) return flat;
  }
  return {sums.A, sums.g};
}

double step_left(const Reduced& reduced, const double* x) {
  const NormalEquations& sums = reduced.at(x, true);
  return Root(sums.A, sums.g).turned.norm();
}

}  // namespace fastcal
