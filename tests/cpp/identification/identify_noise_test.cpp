// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "fastcal/identification/identify.hpp"
#include "identification/scene.hpp"

namespace fastcal::test {
namespace {

TEST(Identify, NoiseIsFoundForEveryKindOfNumberOnItsOwn) {
  for (const LossKind loss : {LossKind::kNone, LossKind::kTukey, LossKind::kHuber, LossKind::kCauchy}) {
    const Scene s = scene(3, What::kPoses, 400, {2e-5, 1e-3});
    const Identification result = s.identified(with(loss));
    EXPECT_EQ(result.status, Status::kConverged) << result.message;
    EXPECT_NEAR(result.sigma[0], 2e-5, 1e-6);
    EXPECT_NEAR(result.sigma[1], 1e-3, 5e-5);
    EXPECT_EQ(result.sigma.size(), 2U);
    EXPECT_EQ(result.rank, 30);
    EXPECT_EQ(result.degrees_of_freedom, 2400 - static_cast<int>(result.free.size()));
  }
}

// Weighted as they deserve, coarse orientations do no harm to positions: with the weights of a first guess they would.
TEST(Identify, WithoutALossTheWeightsOfTheKindsAreSettledToo) {
  const Scene s = scene(4, What::kPoses, 60, {1e-5, 5e-3});
  const Identification result = s.identified(with(LossKind::kNone));
  Random random(5);
  EXPECT_LT(test::rms_distance(s.model, test::postures(random, 200, 6), result.theta, s.truth), 2e-5);
}

TEST(Identify, RowsThatClaimTheirNoiseAreWeighedByIt) {
  Scene s = scene(6, What::kPositions, 200, {});
  Random random(7);
  s.measured.sigma_position = RowMatrixXd::Constant(200, 3, 1e-5);
  s.measured.sigma_position.bottomRows(100).setConstant(1e-3);
  for (Eigen::Index i = 0; i < 200; ++i)
    s.measured.position.row(i) += random.normals(s.measured.sigma_position(i, 0)).transpose();
  const Identification result = s.identified(with(LossKind::kNone));
  EXPECT_LT(result.tau[0], 6e-6);  // the claims explain what remains
  EXPECT_NEAR(result.variance_factor, 1, 0.15);
  EXPECT_LT(test::rms_distance(s.model, test::postures(random, 200, 6), result.theta, s.truth), 1.2e-5);
}

TEST(Identify, NoiseThatTheClaimsDoNotExplainIsFoundAndAdded) {
  for (const LossKind loss : {LossKind::kNone, LossKind::kTukey}) {
    Scene s = scene(8, What::kPositions, 300, {8e-5, 0});
    s.measured.sigma_position = RowMatrixXd::Constant(300, 3, 6e-5);
    Random random(9);
    for (Eigen::Index i = 0; i < 300; ++i) s.measured.position.row(i) += random.normals(6e-5).transpose();
    const Identification result = s.identified(with(loss));
    EXPECT_NEAR(result.tau[0], 8e-5, 6e-6);
    EXPECT_NEAR(result.sigma[0], 1e-4, 5e-6);
    EXPECT_NEAR(result.variance_factor, 1, 0.03);
  }
}

TEST(Identify, ClaimsOfTooMuchNoiseAreBroughtDown) {
  Scene s = scene(10, What::kPositions, 300, {3e-5, 0});
  const Identification unclaimed = s.identified(with(LossKind::kNone));
  s.measured.sigma_position = RowMatrixXd::Constant(300, 3, 3e-4);
  for (const LossKind loss : {LossKind::kNone, LossKind::kTukey, LossKind::kHuber, LossKind::kCauchy}) {
    const Identification result = s.identified(with(loss));
    EXPECT_NEAR(result.sigma[0], 3e-5, 1.5e-6);
    EXPECT_EQ(result.tau[0], 0);
    if (result.free != unclaimed.free) continue;
    const Eigen::VectorXd ratio = result.covariance.diagonal().cwiseQuotient(unclaimed.covariance.diagonal());
    EXPECT_NEAR(ratio.mean(), 1, 0.1);
  }
}

TEST(Identify, GrossPointsLoseTheirWeightAndMoveNothing) {
  Scene s = scene(11, What::kPositions, 100, {5e-5, 0});
  const Identification clean = s.identified();
  Random random(12);
  for (const Eigen::Index i : {3, 40, 41, 77, 99})
    s.measured.position.row(i) += (random.uniform(2e-3, 0.5) * random.unit()).transpose();
  const Samples elsewhere = test::postures(random, 200, 6);
  const double error_clean = test::rms_distance(s.model, elsewhere, clean.theta, s.truth);
  for (const LossKind loss : {LossKind::kTukey, LossKind::kHuber, LossKind::kCauchy}) {
    const Identification result = s.identified(with(loss));
    EXPECT_EQ(result.status, Status::kConverged) << result.message;
    for (const Eigen::Index i : {3, 40, 41, 77, 99}) EXPECT_LT(result.weights[static_cast<std::size_t>(i)].weight, 0.1);
    EXPECT_LT(test::rms_distance(s.model, elsewhere, result.theta, s.truth), 2 * error_clean);
    if (loss != LossKind::kTukey) continue;
    EXPECT_EQ(result.weights[3].weight, 0);
    EXPECT_LT(test::rms_distance(s.model, elsewhere, result.theta, s.truth), 1.3 * error_clean);
    EXPECT_NEAR(result.sigma[0], 5e-5, 5e-6);
  }
  EXPECT_GT(test::rms_distance(s.model, elsewhere, s.identified(with(LossKind::kNone)).theta, s.truth),
            5 * error_clean);
}

}  // namespace
}  // namespace fastcal::test
