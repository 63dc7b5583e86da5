// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identify.hpp"

#include <gtest/gtest.h>

#include "fastcal/math/check.hpp"
#include "identification/scene.hpp"

namespace fastcal::test {
namespace {

TEST(Identify, ExactDataGiveAnExactRobot) {
  for (const LossKind loss : {LossKind::kNone, LossKind::kTukey, LossKind::kHuber, LossKind::kCauchy}) {
    const Scene s = scene(1, What::kPoses, 60, {});
    const Identification result = s.identified(with(loss));
    EXPECT_EQ(result.status, Status::kConverged) << result.message;
    expect_finite(result);
    Random random(2);
    EXPECT_LT(test::rms_distance(s.model, test::postures(random, 50, 6), result.theta, s.truth), 1e-8);
  }
}

TEST(Identify, CovarianceWithoutALossIsThatOfLeastSquares) {
  const Scene s = scene(13, What::kPositions, 80, {5e-5, 0});
  const Identification result = s.identified(with(LossKind::kNone));
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(result.free.size()));
  const NormalEquations sums = normal_equations({s.model, s.samples, s.measured}, result.theta, result.free, ones,
                                                {{1, 1, 1}, LossKind::kNone}, true);
  const double variance = 2 * sums.cost / result.degrees_of_freedom;
  const Eigen::MatrixXd wanted = variance * sums.A.inverse();
  EXPECT_LT((result.covariance - wanted).norm(), 1e-5 * wanted.norm());
  EXPECT_NEAR(result.sigma[0], std::sqrt(variance), 1e-4 * result.sigma[0]);
}

// The house's near-parallel rule: from a tenth of a radian to a billionth, d stays within 20 mm of nominal and
// prediction is as good as anywhere.
TEST(Identify, NearlyParallelAxesNeverSendDAway) {
  for (int step = 0; step <= 16; ++step) {
    const double angle = std::pow(10.0, -1 - 0.5 * step);
    for (int seed = 0; seed < test::repeat(20); ++seed) {
      const Scene s = scene(static_cast<std::uint64_t>(1000 * step + seed), What::kPositions, 60, {5e-5, 0}, 5e-4,
                            seed % 2 == 0 ? angle : -angle);
      const Identification result = s.identified();
      ASSERT_EQ(result.status, Status::kConverged) << result.message;
      expect_finite(result);
      EXPECT_EQ(result.rank, 27);
      for (int k = 0; k < s.model.parameter_count(); ++k) {
        if (s.model.parameters()[static_cast<std::size_t>(k)].name != "d") continue;
        const double change = std::abs(result.theta[k] - s.model.start()[k]);
        EXPECT_LT(change, 0.02) << "angle " << angle << ", seed " << seed << ", " << test::name(s.model, k);
      }
      Random random(7);
      EXPECT_LT(test::rms_distance(s.model, test::postures(random, 50, 6), result.theta, s.truth), 1.5e-4) << angle;
      if (angle > 2e-3) continue;
      EXPECT_TRUE(is_free(result, test::index_of(s.model, "joint2 beta"))) << angle;
      EXPECT_TRUE(is_free(result, test::index_of(s.model, "joint2 d")) !=
                  is_free(result, test::index_of(s.model, "joint3 d")))
          << angle;
    }
  }
}

TEST(Identify, AParallelPairOfTheTruthIsFoundWhateverTheNominalAngle) {
  // Nominal axes cross by 0.01 rad, the true ones are parallel, and the other way round.
  for (const auto& [nominal, change] : {std::pair{0.01, -0.01}, {0.0, 0.01}, {0.0, -0.003}}) {
    Scene s = scene(14, What::kPositions, 80, {3e-5, 0}, 3e-4, nominal);
    s.truth[test::index_of(s.model, "joint2 alpha")] += change;
    Random random(15);
    s.measured = test::measure(random, s.model, s.samples, s.truth, What::kPositions, {3e-5, 0});
    const Identification result = s.identified();
    EXPECT_EQ(result.status, Status::kConverged) << result.message;
    EXPECT_LT(test::rms_distance(s.model, test::postures(random, 100, 6), result.theta, s.truth), 6e-5)
        << nominal << " " << change;
    for (int k = 0; k < s.model.parameter_count(); ++k) {
      if (s.model.parameters()[static_cast<std::size_t>(k)].name != "d") continue;
      EXPECT_LT(std::abs(result.theta[k] - s.model.start()[k]), 0.02) << test::name(s.model, k);
    }
  }
}

TEST(Identify, WhatIsHeldStaysWhereItWas) {
  const Scene s = scene(16, What::kPositions, 80, {5e-5, 0});
  const Identification result = s.identified();
  for (const int k : result.held) EXPECT_EQ(result.theta[k], s.model.start()[k]) << test::name(s.model, k);
  EXPECT_EQ(result.free.size() + result.held.size(), test::asked(s.model, s.what).size());
  EXPECT_EQ(result.unidentifiable.size(), result.held.size());
  EXPECT_EQ(result.unidentifiable_parts.size(), result.held.size());
  for (std::size_t k = 0; k < result.held.size(); ++k)
    EXPECT_EQ(result.unidentifiable_parts[k].front(), result.held[k]);
  for (int k = s.model.parameter_count() - 3; k < s.model.parameter_count(); ++k)
    EXPECT_EQ(result.theta[k], s.model.start()[k]) << "not asked for";
}

// Every direction said to be untold: moving along it leaves the measured points where they are.
TEST(Identify, DirectionsThatCannotBeToldChangeNothing) {
  for (const char* kind : test::kKinds4) {
    Random random(17);
    test::Tables t = test::random_tables(random, 6);
    t.types.assign(6, JointType::kRevolute);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d axis = random.unit();
      t.screws.row(i) << axis.transpose(), (-axis.cross(random.vector(1))).transpose(), 0;
    }
    const ErrorModel model(test::build(kind, t));
    Scene s{model, test::postures(random, 80, 6), {}, model.start(), What::kPositions};
    s.truth = test::disturbed(random, model, 3e-4);
    s.measured = test::measure(random, model, s.samples, s.truth, What::kPositions, {3e-5, 0});
    const Identification result = s.identified();
    EXPECT_EQ(result.rank, 27) << kind;
    EXPECT_EQ(result.status, Status::kConverged) << kind << ": " << result.message;
    // Another start for what is held, and the same fit follows.
    Scene other = s;
    Eigen::VectorXd start = model.start();
    const double before = (result.residuals.leftCols(3)).norm();
    ASSERT_FALSE(result.held.empty());
    std::vector<int> free = result.free;
    for (const int k : result.held) start[k] += 2e-3;
    const Solution again = solve({model, s.samples, s.measured}, start, free,
                                 Eigen::VectorXd::Constant(static_cast<Eigen::Index>(free.size()), 1e-3),
                                 {{1e-4, 1e-4, 1e-4}, LossKind::kNone}, {}, {});
    const Solution first = solve({model, s.samples, s.measured}, result.theta, free,
                                 Eigen::VectorXd::Constant(static_cast<Eigen::Index>(free.size()), 1e-3),
                                 {{1e-4, 1e-4, 1e-4}, LossKind::kNone}, {}, {});
    EXPECT_NEAR(again.cost, first.cost, 0.03 * first.cost) << kind;
    EXPECT_GT(before, 0);
  }
}

TEST(Identify, BfgsIsTheSameAsLeastSquares) {
  const Scene s = scene(18, What::kPositions, 80, {5e-5, 0});
  IdentifyOptions options = with(LossKind::kNone);
  const Identification nls = s.identified(options);
  options.solver = {Method::kBfgs, 500};
  const Identification bfgs = s.identified(options);
  EXPECT_EQ(bfgs.status, Status::kConverged) << bfgs.message;
  EXPECT_EQ(nls.free, bfgs.free);
  EXPECT_LT((nls.theta - bfgs.theta).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((nls.covariance - bfgs.covariance).norm(), 1e-4 * nls.covariance.norm());
}

/// Normal errors: the mean distance is less efficient than the mean square, by 1.18 for three numbers a row.
TEST(Identify, TheMeanDistanceKnowsItsOwnUncertainty) {
  const Scene s = scene(19, What::kPositions, 400, {5e-5, 0});
  IdentifyOptions options = with(LossKind::kNone);
  const Identification nls = s.identified(options);
  options.solver = {Method::kBfgsMeanDistance, 500};
  const Identification mean = s.identified(options);
  EXPECT_EQ(mean.status, Status::kConverged) << mean.message;
  ASSERT_EQ(nls.free, mean.free);
  const double efficiency = std::pow(std::tgamma(2.0) / std::tgamma(1.5), 2) * 2 / 3;  // E[u]^2 / d
  EXPECT_NEAR(mean.covariance.trace() / nls.covariance.trace(), 1 / efficiency, 0.06);
  EXPECT_NEAR(1 / efficiency, 1.178, 1e-3);
}

TEST(Identify, LengthsAloneIdentifyTheArmAndTheirAnchors) {
  Random random(29);
  const ErrorModel model(test::build("dh", test::six_axes(0.7)));
  Scene s{model, test::postures(random, 400, 6), {}, test::disturbed(random, model, 3e-4), What::kPositions};
  s.truth.head<6>() = model.start().head<6>();  // lengths show nothing of the base
  s.truth.tail<3>() = model.start().tail<3>();
  const Eigen::Matrix3Xd anchors = (Eigen::Matrix3Xd(3, 3) << 3, -2, 0.5, 0, 2.5, -3, -0.5, 1, 2).finished();
  s.measured.robot = model.robot();
  s.measured.distance.resize(400);
  s.measured.anchor.resize(400);
  s.measured.anchor_count = 3;
  RowEvaluator rows(model, s.truth);
  for (Eigen::Index i = 0; i < 400; ++i) {
    s.measured.anchor[i] = static_cast<int>(i % 3);
    s.measured.distance[i] = (rows.pose(s.samples.row(i)).p - anchors.col(i % 3)).norm() + random.normal(2e-5);
  }
  const std::vector<int> with_base = test::asked(model, What::kPositions);
  const std::vector<int> asked(with_base.begin() + 6, with_base.end());
  const Eigen::VectorXd start = anchors.reshaped() + Eigen::VectorXd::Constant(9, 2e-3);
  const Identification result = identify({model, s.samples, s.measured}, asked, start, {});
  EXPECT_EQ(result.status, Status::kConverged) << result.message;
  expect_finite(result);
  ASSERT_EQ(result.sigma.size(), 1U);
  EXPECT_NEAR(result.sigma[0], 2e-5, 2e-6);
  EXPECT_EQ(result.parameters.back().owner, "anchor 2");
  EXPECT_EQ(result.theta.size(), model.parameter_count() + 9);
  double worst = 0;
  RowEvaluator there(model, result.theta.head(model.parameter_count()));
  const Samples elsewhere = test::postures(random, 200, 6);
  for (Eigen::Index i = 0; i < 200; ++i) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3d found = result.theta.segment<3>(model.parameter_count() + 3 * a);
      RowEvaluator true_rows(model, s.truth);
      worst = std::max(worst, std::abs((there.pose(elsewhere.row(i)).p - found).norm() -
                                       (true_rows.pose(elsewhere.row(i)).p - anchors.col(a)).norm()));
    }
  }
  EXPECT_LT(worst, 1e-4);
}

TEST(Identify, IsTheSameBitsWhateverTheThreads) {
  for (const What what : {What::kPositions, What::kPoses}) {
    const Scene s = scene(30, what, 1200, {5e-5, 1e-4});
    const Identification one = s.identified({}, 1);
    for (const int threads : {2, 5}) {
      const Identification other = s.identified({}, threads);
      EXPECT_EQ(one.theta, other.theta);
      EXPECT_EQ(one.covariance, other.covariance);
      EXPECT_EQ(one.free, other.free);
      EXPECT_EQ(one.iterations, other.iterations);
    }
  }
}

TEST(Identify, KnownNoiseIsTakenAsItIsAndDeviationsFollowIt) {
  const Scene s = scene(32, What::kPoses, 60, {5e-5, 1e-4});
  IdentifyOptions options;
  options.loss = LossKind::kNone;
  options.noise = {5e-5, 1e-4};
  const Identification once = s.identified(options);
  EXPECT_EQ(once.tau, options.noise);
  options.noise = {1e-4, 2e-4};
  const Identification twice = s.identified(options);
  ASSERT_EQ(once.free, twice.free);
  EXPECT_LT((once.theta - twice.theta).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((4 * once.covariance - twice.covariance).norm(), 1e-6 * twice.covariance.norm());
  options.noise = {1e-4};
  EXPECT_THROW(s.identified(options), InvalidInput);
}

TEST(Identify, BadOptionsAreRefusedInASentence) {
  const Scene s = scene(31, What::kPositions, 20, {5e-5, 0});
  const int p = s.model.parameter_count();
  const auto refusal = [&](const std::vector<int>& asked, const IdentifyOptions& options,
                           Eigen::Index unknowns = 0) -> std::string {
    try {
      identify({s.model, s.samples, s.measured}, asked, Eigen::VectorXd::Zero(unknowns), options);
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  EXPECT_EQ(refusal({p}, {}), "asked parameters must be 0 to 41, got 42");
  EXPECT_EQ(refusal({-1}, {}), "asked parameters must be 0 to 41, got -1");
  EXPECT_EQ(refusal({1, 2, 1}, {}), "asked parameters must differ from each other");
  EXPECT_EQ(refusal({1}, {}, 2), "the observations have 0 unknowns, got 2 starting values");
  IdentifyOptions options;
  options.limits.prior_mean = options.limits.prior_sigma = Eigen::VectorXd::Ones(3);
  EXPECT_EQ(refusal({1}, options), "priors must be 42 means and as many standard deviations, or none");
  options.limits.prior_mean = Eigen::VectorXd::Zero(p);
  options.limits.prior_sigma = Eigen::VectorXd::Zero(p);
  EXPECT_EQ(refusal({1}, options), "priors must have finite means and positive standard deviations");
  options.limits.prior_mean = options.limits.prior_sigma = Eigen::VectorXd();
  options.limits.pull_mean = Eigen::VectorXd::Zero(p);
  EXPECT_EQ(refusal({1}, options), "pulls must be 42 finite means and as many positive sizes, or none");
  options = {};
  options.limits.lower = Eigen::VectorXd::Zero(p);
  EXPECT_EQ(refusal({1}, options), "bounds must be 42 lower and as many upper ones, or none");
  options.limits.upper = Eigen::VectorXd::Zero(p);
  EXPECT_EQ(refusal({1}, options), "each lower bound must be below its upper bound");
  options.limits.upper.setOnes();
  options.solver.method = Method::kBfgs;
  EXPECT_EQ(refusal({1}, options), "bounds need least squares; BFGS with a line search has none");
}

}  // namespace
}  // namespace fastcal::test
