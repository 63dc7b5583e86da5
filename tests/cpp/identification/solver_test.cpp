// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The reduced problem against plain ones: dense sums, Ceres with a residual block a row and QR, differences of the
// cost.
#include "fastcal/identification/solver.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "fastcal/identification/row_errors.hpp"
#include "fastcal/model/prediction.hpp"
#include "identification/fixed_scene.hpp"

namespace fastcal {
namespace {

using test::Fixed;
using test::fixed;
using test::kTau;
using test::moved;
using test::Random;
using test::What;

/// One row's whitened residual for Ceres, J from the row's own derivative: no reduction anywhere.
class RowCost : public ceres::CostFunction {
 public:
  RowCost(const Fixed& s, Eigen::Index row) : s_(s), row_(row) {
    set_num_residuals(3);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(s.free.size()));
  }
  bool Evaluate(double const* const* x, double* r, double** jacobians) const override {
    const auto m = static_cast<Eigen::Index>(s_.free.size());
    RowEvaluator evaluator(s_.model, moved(s_, Eigen::Map<const Eigen::VectorXd>(x[0], m)));
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, s_.model.parameter_count());
    const Pose& T = evaluator.jacobian(s_.samples.row(row_), J);
    Eigen::Map<Eigen::Vector3d> out(r);
    out = (T.p - s_.measured.position.row(row_).transpose()) / kTau[0];
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<RowMatrixXd> J_out(jacobians[0], 3, m);
    for (Eigen::Index k = 0; k < m; ++k)
      J_out.col(k) = J.block<3, 1>(0, s_.free[static_cast<std::size_t>(k)]) * s_.scale[k] / kTau[0];
    return true;
  }

 private:
  const Fixed& s_;
  Eigen::Index row_;
};

Eigen::VectorXd solve_by_rows(const Fixed& s) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(s.free.size()));
  ceres::Problem problem;
  for (Eigen::Index i = 0; i < s.samples.count(); ++i) problem.AddResidualBlock(new RowCost(s, i), nullptr, x.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = 1e-16;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.initial_trust_region_radius = 1e16;
  options.max_trust_region_radius = 1e20;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_TRUE(summary.IsSolutionUsable());
  return moved(s, x);
}

TEST(Solve, AgreesWithQrOfTheRowsOnAnIllConditionedProblem) {
  // Both d of two axes 1e-2 rad from parallel, and few rows.
  Fixed s = fixed(6, What::kPositions, 14);
  const double ordinary = [&] {
    const auto values =
        triangular_factor(s.problem(), s.model.start(), s.free, s.scale, {kTau}).jacobiSvd().singularValues().eval();
    return values[0] / values.tail<1>()[0];
  }();
  const ErrorModel nearly(test::build("dh", test::six_axes(1e-2)));
  Random random(6);
  s.model = nearly;
  s.truth = test::disturbed(random, nearly, 0);
  for (const int k : s.free) s.truth[k] += random.normal(1e-5);
  s.measured = test::measure(random, nearly, s.samples, s.truth, What::kPositions, {2e-7, 0});
  const Eigen::MatrixXd R = triangular_factor(s.problem(), s.model.start(), s.free, s.scale, {kTau});
  const Eigen::VectorXd values = R.jacobiSvd().singularValues();
  ASSERT_GT(values[0] / values.tail<1>()[0], 300 * ordinary);
  const Eigen::VectorXd oracle = solve_by_rows(s);
  const Solution found = solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {});
  EXPECT_TRUE(found.converged) << found.message;
  Eigen::VectorXd difference(static_cast<Eigen::Index>(s.free.size()));
  for (std::size_t k = 0; k < s.free.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    difference[i] = (found.theta[s.free[k]] - oracle[s.free[k]]) / s.scale[i];
  }
  // Against the deviation that noise of the size of tau gives each direction: |R x| in deviations.
  EXPECT_LT((R * difference).norm(), 1e-6);
  EXPECT_LT(difference.cwiseAbs().maxCoeff() * 1e-3, 1e-7) << "m and rad";
}

TEST(Solve, GivesTheSameAsQrOfTheRowsOnAnOrdinaryProblem) {
  const Fixed s = fixed(7, What::kPositions, 50);
  const Eigen::VectorXd oracle = solve_by_rows(s);
  const Solution found = solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {});
  EXPECT_TRUE(found.converged) << found.message;
  EXPECT_LT((found.theta - oracle).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(Bfgs, FindsWhatLeastSquaresFinds) {
  for (const What what : {What::kPositions, What::kPoses}) {
    const Fixed s = fixed(8, what, 60);
    const Solution nls = solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {});
    const Solution bfgs =
        solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {Method::kBfgs, 500});
    EXPECT_TRUE(nls.converged && bfgs.converged) << bfgs.message;
    EXPECT_LT((nls.theta - bfgs.theta).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT(test::rms_distance(s.model, s.samples, nls.theta, bfgs.theta), 1e-9);
  }
}

TEST(TrustRegion, AloneFindsWhatNewtonsStepsFind) {
  for (const What what : {What::kPositions, What::kPoses}) {
    const Fixed s = fixed(8, what, 60);
    const Solution newton = solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kTukey}, {}, {});
    const Solution ceres =
        solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kTukey}, {}, {Method::kTrustRegion, 100});
    EXPECT_TRUE(newton.converged && ceres.converged) << ceres.message;
    EXPECT_GT(ceres.iterations, 0);
    EXPECT_LT((newton.theta - ceres.theta).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT(test::rms_distance(s.model, s.samples, newton.theta, ceres.theta), 1e-9);
  }
}

/// The cost that the PMC paper prints: the mean distance of the points [m].
double mean_distance(const Fixed& s, const Eigen::VectorXd& theta) {
  RowEvaluator rows(s.model, theta);
  double sum = 0;
  for (Eigen::Index i = 0; i < s.samples.count(); ++i)
    sum += (rows.pose(s.samples.row(i)).p - s.measured.position.row(i).transpose()).norm();
  return sum / static_cast<double>(s.samples.count());
}

TEST(Bfgs, OnTheMeanDistanceEndsWhereItHasNoSlopeAndBelowLeastSquares) {
  const Fixed s = fixed(9, What::kPositions, 60);
  const Weighting weighting{{5e-5, 5e-5, 5e-5}, LossKind::kNone};
  const Solution nls = solve(s.problem(), s.model.start(), s.free, s.scale, weighting, {}, {});
  const Solution mean =
      solve(s.problem(), s.model.start(), s.free, s.scale, weighting, {}, {Method::kBfgsMeanDistance, 500});
  EXPECT_TRUE(mean.converged) << mean.message;
  const double least = mean_distance(s, mean.theta);
  EXPECT_LT(least, mean_distance(s, nls.theta));
  EXPECT_GT((mean.theta - nls.theta).cwiseAbs().maxCoeff(), 1e-7) << "they are different problems";
  for (const int k : s.free) {
    const auto at = [&](double step) {
      return mean_distance(s, mean.theta + step * Eigen::VectorXd::Unit(mean.theta.size(), k));
    };
    // A slope of 1 is a metre a metre; 1e-7 s.d. of it would not move the parameters.
    EXPECT_NEAR((at(1e-8) - at(-1e-8)) / 2e-8, 0, 1e-5) << test::name(s.model, k);
    EXPECT_GT(at(1e-5), least);
    EXPECT_GT(at(-1e-5), least);
  }
}

TEST(Solve, StopsAtABoundWhereTheCostOnlyFallsBeyondIt) {
  const Fixed s = fixed(10, What::kPositions, 60);
  const Weighting weighting{kTau, LossKind::kNone};
  const Solution inside = solve(s.problem(), s.model.start(), s.free, s.scale, weighting, {}, {});
  const int bound = test::index_of(s.model, "joint3 a");
  for (const double sign : {1.0, -1.0}) {
    for (const bool from_outside : {false, true}) {
      Limits limits;
      limits.lower = Eigen::VectorXd::Constant(s.model.parameter_count(), -std::numeric_limits<double>::infinity());
      limits.upper = -limits.lower;
      const double at = inside.theta[bound] - sign * 1e-4;  // the minimum lies 0.1 mm beyond
      (sign > 0 ? limits.upper : limits.lower)[bound] = at;
      Eigen::VectorXd start = s.model.start();
      start[bound] = at - (from_outside ? -1 : 1) * sign * 3e-4;
      const Solution found = solve(s.problem(), start, s.free, s.scale, weighting, limits, {});
      EXPECT_TRUE(found.converged) << found.message;
      EXPECT_NEAR(found.theta[bound], at, 1e-12);
      const NormalEquations there = normal_equations(s.problem(), found.theta, s.free, s.scale, weighting, true);
      for (std::size_t k = 0; k < s.free.size(); ++k) {
        const double slope = there.g[static_cast<Eigen::Index>(k)] /
                             std::sqrt(there.A(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)));
        if (s.free[k] == bound) {
          EXPECT_LT(sign * slope, -1e-3) << "the cost falls beyond the bound";
        } else {
          EXPECT_NEAR(slope, 0, 1e-6) << test::name(s.model, s.free[k]);
        }
      }
    }
  }
}

TEST(Solve, BalancesPriorsAgainstTheData) {
  const Fixed s = fixed(11, What::kPositions, 20);
  const Weighting weighting{kTau, LossKind::kNone};
  Limits limits;
  limits.prior_mean = s.model.start();
  limits.prior_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < s.free.size(); k += 2) limits.prior_sigma[s.free[k]] = 1e-4;
  const Solution found = solve(s.problem(), s.model.start(), s.free, s.scale, weighting, limits, {});
  EXPECT_TRUE(found.converged) << found.message;
  const NormalEquations data = normal_equations(s.problem(), found.theta, s.free, s.scale, weighting, true);
  double pulled = 0;
  for (std::size_t k = 0; k < s.free.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double sigma = limits.prior_sigma[s.free[k]];
    const double prior = s.scale[i] * (found.theta[s.free[k]] - limits.prior_mean[s.free[k]]) / (sigma * sigma);
    EXPECT_NEAR(data.g[i] + (std::isfinite(sigma) ? prior : 0), 0, 1e-6 * std::sqrt(data.A(i, i)));
    pulled = std::max(pulled, std::abs(data.g[i]) / std::sqrt(data.A(i, i)));
  }
  EXPECT_GT(pulled, 0.1) << "the priors did nothing";
  double squares = 0;
  for (const int k : s.free) {
    if (std::isfinite(limits.prior_sigma[k]))
      squares += std::pow((found.theta[k] - limits.prior_mean[k]) / limits.prior_sigma[k], 2);
  }
  EXPECT_NEAR(found.cost, data.cost + squares / 2, 1e-9 * found.cost);
}

TEST(Solve, NothingFreeIsNothingDone) {
  const Fixed s = fixed(12, What::kPositions, 10);
  for (const Method method : {Method::kLeastSquares, Method::kBfgs, Method::kBfgsMeanDistance}) {
    const Solution found =
        solve(s.problem(), s.model.start(), {}, Eigen::VectorXd(0), {kTau, LossKind::kNone}, {}, {method, 100});
    EXPECT_TRUE(found.converged);
    EXPECT_EQ(found.theta, s.model.start());
    EXPECT_GT(found.cost, 0);
  }
}

TEST(RowWeights, AreThoseOfTheRowsWhitenedLength) {
  Fixed s = fixed(13, What::kPoses, 3);
  s.measured.position.row(1).setConstant(std::nan(""));
  s.measured.rotation.row(1).setConstant(std::nan(""));
  s.measured.rotation.row(2).setConstant(std::nan(""));
  const RowMatrixXd r = residuals(s.problem(), s.model.start());
  const auto rows = RowErrors(s.problem(), r).weights({kTau, LossKind::kHuber});
  const double squared =
      r.row(0).head<3>().squaredNorm() / (1e-4 * 1e-4) + r.row(0).segment<3>(3).squaredNorm() / (2e-4 * 2e-4);
  EXPECT_NEAR(rows[0].squared, squared, 1e-9 * squared);
  EXPECT_EQ(rows[0].components, 6);
  EXPECT_EQ(rows[0].weight, tuned_loss(LossKind::kHuber, 6).weight(rows[0].squared));
  EXPECT_EQ(rows[1].components, 0);
  EXPECT_EQ(rows[1].weight, 0);
  EXPECT_EQ(rows[2].components, 3);
  EXPECT_TRUE(std::isnan(r(2, 3)));
  EXPECT_EQ(r.cols(), 6);
}

// Every third parameter may not go where the data want it, every third starts at a bound that it must leave: at the
// solution the cost is flat for those inside, and falls beyond the bound for the others.
TEST(Solve, HoldsWhatABoundHoldsAndReleasesWhatItDoesNot) {
  const Fixed s = fixed(11, What::kPoses, 60);
  const Eigen::Index p = s.scale.size();
  const Eigen::VectorXd start = s.model.start();
  Limits limits;
  limits.lower = Eigen::VectorXd::Constant(start.size(), -std::numeric_limits<double>::infinity());
  limits.upper = -limits.lower;
  for (Eigen::Index k = 0; k < p; ++k) {
    const int index = s.free[static_cast<std::size_t>(k)];
    const bool up = s.truth[index] > start[index];
    if (k % 3 == 0) (up ? limits.upper : limits.lower)[index] = start[index] + 0.5 * (s.truth[index] - start[index]);
    if (k % 3 == 1) (up ? limits.lower : limits.upper)[index] = start[index];
  }
  for (const LossKind loss : {LossKind::kNone, LossKind::kHuber}) {
    const Solution found = solve(s.problem(), start, s.free, s.scale, {kTau, loss}, limits, {});
    EXPECT_TRUE(found.converged);
    EXPECT_LT(found.iterations, 40);  // Ceres alone creeps along active bounds for hundreds
    const NormalEquations end = normal_equations(s.problem(), found.theta, s.free, s.scale, {kTau, loss}, true);
    int held = 0;
    for (Eigen::Index k = 0; k < p; ++k) {
      const int index = s.free[static_cast<std::size_t>(k)];
      const double x = found.theta[index];
      EXPECT_GE(x, limits.lower[index] - 1e-15);
      EXPECT_LE(x, limits.upper[index] + 1e-15);
      const double slope = end.g[k] / std::sqrt(end.A(k, k));
      if (std::abs(slope) < 1e-4) continue;
      EXPECT_NEAR(x, slope > 0 ? limits.lower[index] : limits.upper[index], 1e-12) << k;
      ++held;
    }
    EXPECT_GE(held, 2);
    EXPECT_LT(held, p);
  }
}

// A robust loss converges by a factor a step: the last steps end it.
TEST(Solve, GoesToTheMinimumItselfWhereAsked) {
  const Fixed s = fixed(12, What::kPositions, 60);
  SolverOptions tight;
  tight.settled = 1e-10;
  const Solution found =
      solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kHuber}, Limits(), tight);
  const NormalEquations end =
      normal_equations(s.problem(), found.theta, s.free, s.scale, {kTau, LossKind::kHuber}, true);
  EXPECT_GT(end.A.diagonal().minCoeff(), 0);
  EXPECT_LT(std::sqrt(end.g.dot(end.A.ldlt().solve(end.g))), 1e-10);
}

}  // namespace
}  // namespace fastcal
