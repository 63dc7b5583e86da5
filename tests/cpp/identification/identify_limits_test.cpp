// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Bounds, priors, pulls and a gauge that is off.
#include <gtest/gtest.h>

#include "fastcal/identification/identify.hpp"
#include "fastcal/math/check.hpp"
#include "identification/scene.hpp"

namespace fastcal::test {
namespace {

TEST(Identify, BoundsAreKept) {
  const Scene s = scene(20, What::kPositions, 80, {5e-5, 0});
  const Identification open = s.identified();
  IdentifyOptions options;
  options.limits.lower = Eigen::VectorXd::Constant(s.model.parameter_count(), -kInfinite);
  options.limits.upper = Eigen::VectorXd::Constant(s.model.parameter_count(), kInfinite);
  int bounded = 0;
  for (const int k : open.free) {
    if (++bounded % 5 != 0) continue;
    options.limits.upper[k] = open.theta[k] - 1e-4;
  }
  const Identification result = s.identified(options);
  expect_finite(result);
  for (int k = 0; k < s.model.parameter_count(); ++k)
    EXPECT_LE(result.theta[k], options.limits.upper[k] + 1e-12) << test::name(s.model, k);
}

TEST(Identify, PriorsFreeEveryParameterAndAreNotCountedAsItsFreedom) {
  const Scene s = scene(21, What::kPositions, 8, {5e-5, 0}, 1e-4);
  IdentifyOptions options = with(LossKind::kNone);
  options.limits.prior_mean = s.model.start();
  options.limits.prior_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), 1e-4);
  const Identification result = s.identified(options);
  EXPECT_EQ(result.status, Status::kConverged) << result.message;
  expect_finite(result);
  EXPECT_TRUE(result.held.empty());
  EXPECT_LE(result.rank, 24);  // 24 numbers were measured
  EXPECT_GT(result.degrees_of_freedom, 0);
  EXPECT_LT(result.degrees_of_freedom, 24);
  EXPECT_LT(result.sigma[0], 2e-4);
  EXPECT_GT(result.sigma[0], 1e-5);
  for (Eigen::Index k = 0; k < result.covariance.rows(); ++k)
    EXPECT_LE(std::sqrt(result.covariance(k, k)), 1.0001e-4) << "no surer than the prior?";
}

TEST(Identify, WeakPriorsAreNone) {
  const Scene s = scene(22, What::kPositions, 100, {5e-5, 0});
  const Identification without = s.identified();
  IdentifyOptions options;
  options.limits.prior_mean =
      Eigen::VectorXd::Zero(s.model.parameter_count());  // far from base and tool: an infinite sigma has no mean
  options.limits.prior_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), kInfinite);
  const Identification with_priors = s.identified(options);
  EXPECT_EQ(without.free, with_priors.free);
  EXPECT_LT((without.theta - with_priors.theta).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_EQ(without.degrees_of_freedom, with_priors.degrees_of_freedom);
  EXPECT_EQ(without.rank, with_priors.rank);
}

TEST(Identify, APullDrawsWhatTheDataHardlyTellAndIsNoKnowledge) {
  // Poses that hardly tell: a tenth of a radian about each joint.
  Random random(35);
  Scene s = scene(35, What::kPositions, 60, {5e-5, 0});
  s.samples = test::postures(random, 60, 6, 0.1);
  s.measured = test::measure(random, s.model, s.samples, s.truth, What::kPositions, {5e-5, 0});
  const Identification free = s.identified(with(LossKind::kNone));
  IdentifyOptions options = with(LossKind::kNone);
  options.limits.pull_mean = s.model.start();
  options.limits.pull_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), 3e-4);
  const Identification pulled = s.identified(options);
  EXPECT_EQ(pulled.free, free.free);
  EXPECT_EQ(pulled.rank, free.rank);
  EXPECT_EQ(pulled.degrees_of_freedom, free.degrees_of_freedom);
  const double noise = pulled.sigma[0] / free.sigma[0];
  EXPECT_LT(noise, 1.1);
  for (std::size_t k = 0; k < free.free.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    EXPECT_NEAR(std::sqrt(pulled.covariance(i, i) / free.covariance(i, i)) / noise, 1, 0.05);
  }
  const Eigen::VectorXd start = s.model.start();
  EXPECT_LT((pulled.theta - start).norm(), 0.5 * (free.theta - start).norm());
}

TEST(Identify, WithoutAGaugePriorsHoldWhatTheDataDoNotShow) {
  const Scene s = scene(33, What::kPoses, 60, {5e-5, 1e-4});
  IdentifyOptions options;
  options.gauge.off = true;
  options.loss = LossKind::kNone;
  EXPECT_FALSE(s.identified().held.empty());
  options.limits.prior_mean = s.model.start();
  options.limits.prior_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), 1e-2);
  const Identification result = s.identified(options);
  EXPECT_TRUE(result.held.empty());
  EXPECT_EQ(result.free.size(), 42U);
  expect_finite(result);
  Random random(34);
  EXPECT_LT(test::rms_distance(s.model, test::postures(random, 100, 6), result.theta, s.truth), 1e-4);
}

}  // namespace
}  // namespace fastcal::test
