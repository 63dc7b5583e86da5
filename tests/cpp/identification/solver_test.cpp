// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The reduced problem against plain ones: dense sums, Ceres with a residual block a row and QR, differences of the
// cost.
#include "fastcal/identification/solver.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "fastcal/model/prediction.hpp"
#include "support/simulation.hpp"

namespace fastcal {
namespace {

using test::Random;
using test::What;

/// A disturbed arm, its data, and parameters that the data fix.
struct Scene {
  ErrorModel model;
  Samples samples;
  test::Measured measured;
  std::vector<int> free;
  Eigen::VectorXd scale;
  Eigen::VectorXd truth;

  Problem problem(int threads = 1) const { return {model, samples, measured, threads}; }
};

Scene scene(std::uint64_t seed, What what, Eigen::Index rows, double error = 5e-4) {
  Random random(seed);
  Scene out{ErrorModel(test::build("dh", test::six_axes(0.7))), test::postures(random, rows, 6), {}, {}, {}, {}};
  out.truth = test::disturbed(random, out.model, error);
  out.measured = test::measure(random, out.model, out.samples, out.truth, what, {5e-5, 5e-5});
  const Problem problem = out.problem();
  const std::vector<int> asked = test::asked(out.model, what);
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(asked.size()), 1e-3);
  Eigen::VectorXd hold(scale.size());
  for (std::size_t k = 0; k < asked.size(); ++k)
    hold[static_cast<Eigen::Index>(k)] = hold_preference(out.model.parameters()[static_cast<std::size_t>(asked[k])]);
  const Gauge gauge =
      choose_gauge(triangular_factor(problem, out.model.start(), asked, scale, {1e-4, 1e-4, 1e-4}, nullptr), hold);
  for (const int k : gauge.free) out.free.push_back(asked[static_cast<std::size_t>(k)]);
  out.scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(out.free.size()), 1e-3);
  return out;
}

const CommonNoise kTau{1e-4, 2e-4, 3e-4};

Eigen::VectorXd moved(const Scene& s, const Eigen::VectorXd& x) {
  Eigen::VectorXd theta = s.model.start();
  for (std::size_t k = 0; k < s.free.size(); ++k)
    theta[s.free[k]] += s.scale[static_cast<Eigen::Index>(k)] * x[static_cast<Eigen::Index>(k)];
  return theta;
}

// A row at a time, weights from its own length, J from the public parameter_jacobian.
TEST(NormalEquations, AreTheDenseOnes) {
  Scene s = scene(1, What::kPoses, 700);
  s.measured.position(3, 1) = std::nan("");
  s.measured.rotation.row(4).setConstant(std::nan(""));
  s.measured.position.row(5).setConstant(std::nan(""));
  s.measured.rotation.row(5).setConstant(std::nan(""));
  Random random(2);
  s.measured.sigma_position = RowMatrixXd::NullaryExpr(700, 3, [&] { return random.uniform(1e-5, 1e-3); });
  const int p = s.model.parameter_count();
  std::vector<double> J_all(static_cast<std::size_t>(700 * 6 * p));
  const Eigen::VectorXd theta = s.model.start();
  parameter_jacobian(s.model, s.samples, theta, 6, 1, J_all.data());
  const auto m = static_cast<Eigen::Index>(s.free.size());
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kTukey, LossKind::kDistance}) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(m, m);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(m);
    double cost = 0;
    RowEvaluator rows(s.model, theta);
    for (Eigen::Index i = 0; i < 700; ++i) {
      const Pose T = rows.pose(s.samples.row(i));
      const Eigen::Map<const RowMatrixXd> J_tool(&J_all[static_cast<std::size_t>(6 * i * p)], 6, p);
      double squared = 0;
      int d = 0;
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, m);
      Eigen::VectorXd r = Eigen::VectorXd::Zero(6);
      for (int c = 0; c < 3; ++c) {
        if (std::isnan(s.measured.position(i, c))) continue;
        const double sigma = std::hypot(s.measured.sigma_position(i, c), kTau[0]);
        for (Eigen::Index k = 0; k < m; ++k) J(c, k) = J_tool(c, s.free[k]) * s.scale[k] / sigma;
        r[c] = (T.p[c] - s.measured.position(i, c)) / sigma;
        ++d;
      }
      if (!s.measured.rotation.row(i).hasNaN()) {
        const Eigen::Matrix3d R_measured = quaternion_to_rotation(s.measured.rotation.row(i).transpose());
        const Eigen::Vector3d turn = log_so3(R_measured.transpose() * T.R);
        const Eigen::Matrix3d slope = right_jacobian_inverse_so3(turn) * T.R.transpose();
        for (Eigen::Index k = 0; k < m; ++k)
          J.col(k).tail<3>() = slope * J_tool.col(s.free[k]).tail<3>() * s.scale[k] / kTau[1];
        r.tail<3>() = turn / kTau[1];
        d += 3;
      }
      squared = r.squaredNorm();
      if (d == 0) continue;
      const Loss& loss = tuned_loss(kind, d);
      A += loss.weight(squared) * J.transpose() * J;
      g += loss.weight(squared) * J.transpose() * r;
      cost += loss.rho(squared) / 2;
    }
    const NormalEquations found = normal_equations(s.problem(), theta, s.free, s.scale, {kTau, kind}, true);
    EXPECT_LT((found.A - A).norm(), 1e-12 * A.norm());
    EXPECT_LT((found.g - g).norm(), 1e-12 * g.norm());
    EXPECT_NEAR(found.cost, cost, 1e-12 * cost);
    EXPECT_NEAR(normal_equations(s.problem(), theta, s.free, s.scale, {kTau, kind}, false).cost, cost, 1e-12 * cost);
  }
}

TEST(NormalEquations, AreTheSameBitsWhateverTheThreads) {
  const Scene s = scene(3, What::kPoses, 1500);
  const NormalEquations one =
      normal_equations(s.problem(1), s.model.start(), s.free, s.scale, {kTau, LossKind::kTukey}, true);
  const Eigen::MatrixXd R = triangular_factor(s.problem(1), s.model.start(), s.free, s.scale, kTau, nullptr);
  for (const int threads : {2, 5}) {
    const NormalEquations other =
        normal_equations(s.problem(threads), s.model.start(), s.free, s.scale, {kTau, LossKind::kTukey}, true);
    EXPECT_EQ(one.A, other.A);
    EXPECT_EQ(one.g, other.g);
    EXPECT_EQ(one.cost, other.cost);
    EXPECT_EQ(R, triangular_factor(s.problem(threads), s.model.start(), s.free, s.scale, kTau, nullptr));
  }
}

TEST(NormalEquations, GradientIsThatOfTheCostWithLengthsAndAnchorsToo) {
  Random random(4);
  Scene s = scene(4, What::kPositions, 40);
  s.measured.position.topRows(20).setConstant(std::nan(""));
  s.measured.distance = Eigen::VectorXd::Constant(40, std::nan(""));
  s.measured.distance.head(30).setConstant(2.2);
  s.measured.anchor = Eigen::VectorXi::NullaryExpr(40, [](Eigen::Index i) { return static_cast<int>(i % 2); });
  s.measured.anchor_count = 2;
  const int p = s.model.parameter_count();
  for (int k = 0; k < 6; ++k) s.free.push_back(p + k);
  s.scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(s.free.size()), 1e-3);
  Eigen::VectorXd theta(p + 6);
  theta << s.model.start(), random.values(6, 2);
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey}) {
    const CommonNoise tau{0.3, 0.3, 0.3};
    const NormalEquations found = normal_equations(s.problem(), theta, s.free, s.scale, {tau, kind}, true);
    for (std::size_t k = 0; k < s.free.size(); ++k) {
      const auto cost = [&](double step) {
        Eigen::VectorXd there = theta;
        there[s.free[k]] += step;
        return normal_equations(s.problem(), there, s.free, s.scale, {tau, kind}, false).cost;
      };
      constexpr double h = 1e-4;
      const double slope = (8 * (cost(h) - cost(-h)) - (cost(2 * h) - cost(-2 * h))) / (12 * h);
      EXPECT_NEAR(found.g[static_cast<Eigen::Index>(k)], 1e-3 * slope, 1e-9 * (1 + std::abs(slope))) << k;
    }
  }
}

TEST(TriangularFactor, IsARootOfTheNormalEquations) {
  Scene s = scene(5, What::kPoses, 600);
  const NormalEquations sums = normal_equations(s.problem(), s.truth, s.free, s.scale, {kTau, LossKind::kNone}, true);
  const Eigen::MatrixXd R = triangular_factor(s.problem(), s.truth, s.free, s.scale, kTau, nullptr);
  EXPECT_LT((R.transpose() * R - sums.A).norm(), 1e-12 * sums.A.norm());
  EXPECT_TRUE(R.isUpperTriangular());
  std::vector<RowWeight> rows(600);
  for (std::size_t i = 300; i < 600; ++i) rows[i].weight = 0;
  s.samples.q.conservativeResize(300, 6);
  s.measured.position.conservativeResize(300, 3);
  s.measured.rotation.conservativeResize(300, 4);
  const Scene half = s;
  const Scene whole = scene(5, What::kPoses, 600);
  EXPECT_LT((triangular_factor(whole.problem(), s.truth, s.free, s.scale, kTau, &rows).cwiseAbs() -
             triangular_factor(half.problem(), s.truth, s.free, s.scale, kTau, nullptr).cwiseAbs())
                .norm(),
            1e-9 * R.norm());
}

/// One row's whitened residual for Ceres, J from the row's own derivative: no reduction anywhere.
class RowCost : public ceres::CostFunction {
 public:
  RowCost(const Scene& s, Eigen::Index row) : s_(s), row_(row) {
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
  const Scene& s_;
  Eigen::Index row_;
};

Eigen::VectorXd solve_by_rows(const Scene& s) {
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
  Scene s = scene(6, What::kPositions, 14);
  const double ordinary = [&] {
    const auto values = triangular_factor(s.problem(), s.model.start(), s.free, s.scale, kTau, nullptr)
                            .jacobiSvd()
                            .singularValues()
                            .eval();
    return values[0] / values.tail<1>()[0];
  }();
  const ErrorModel nearly(test::build("dh", test::six_axes(1e-2)));
  Random random(6);
  s.model = nearly;
  s.truth = test::disturbed(random, nearly, 0);
  for (const int k : s.free) s.truth[k] += random.normal(1e-5);
  s.measured = test::measure(random, nearly, s.samples, s.truth, What::kPositions, {2e-7, 0});
  const Eigen::MatrixXd R = triangular_factor(s.problem(), s.model.start(), s.free, s.scale, kTau, nullptr);
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
  const Scene s = scene(7, What::kPositions, 50);
  const Eigen::VectorXd oracle = solve_by_rows(s);
  const Solution found = solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {});
  EXPECT_TRUE(found.converged) << found.message;
  EXPECT_LT((found.theta - oracle).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(Bfgs, FindsWhatLeastSquaresFinds) {
  for (const What what : {What::kPositions, What::kPoses}) {
    const Scene s = scene(8, what, 60);
    const Solution nls = solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {});
    const Solution bfgs =
        solve(s.problem(), s.model.start(), s.free, s.scale, {kTau, LossKind::kNone}, {}, {Method::kBfgs, 500});
    EXPECT_TRUE(nls.converged && bfgs.converged) << bfgs.message;
    EXPECT_LT((nls.theta - bfgs.theta).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT(test::rms_distance(s.model, s.samples, nls.theta, bfgs.theta), 1e-9);
  }
}

/// The cost that the PMC paper prints: the mean distance of the points [m].
double mean_distance(const Scene& s, const Eigen::VectorXd& theta) {
  RowEvaluator rows(s.model, theta);
  double sum = 0;
  for (Eigen::Index i = 0; i < s.samples.count(); ++i)
    sum += (rows.pose(s.samples.row(i)).p - s.measured.position.row(i).transpose()).norm();
  return sum / static_cast<double>(s.samples.count());
}

TEST(Bfgs, OnTheMeanDistanceEndsWhereItHasNoSlopeAndBelowLeastSquares) {
  const Scene s = scene(9, What::kPositions, 60);
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
  const Scene s = scene(10, What::kPositions, 60);
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
  const Scene s = scene(11, What::kPositions, 20);
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
  const Scene s = scene(12, What::kPositions, 10);
  for (const Method method : {Method::kLeastSquares, Method::kBfgs, Method::kBfgsMeanDistance}) {
    const Solution found =
        solve(s.problem(), s.model.start(), {}, Eigen::VectorXd(0), {kTau, LossKind::kNone}, {}, {method, 100});
    EXPECT_TRUE(found.converged);
    EXPECT_EQ(found.theta, s.model.start());
    EXPECT_GT(found.cost, 0);
  }
}

TEST(RowWeights, AreThoseOfTheRowsWhitenedLength) {
  Scene s = scene(13, What::kPoses, 3);
  s.measured.position.row(1).setConstant(std::nan(""));
  s.measured.rotation.row(1).setConstant(std::nan(""));
  s.measured.rotation.row(2).setConstant(std::nan(""));
  const RowMatrixXd r = residuals(s.problem(), s.model.start());
  const auto rows = row_weights(s.problem(), r, {kTau, LossKind::kHuber});
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

}  // namespace
}  // namespace fastcal
