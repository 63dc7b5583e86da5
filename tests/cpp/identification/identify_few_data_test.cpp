// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows that lack parts, too few rows, and none.
#include <gtest/gtest.h>

#include <cmath>

#include "fastcal/identification/identify.hpp"
#include "fastcal/math/check.hpp"
#include "identification/scene.hpp"

namespace fastcal::test {
namespace {

TEST(Identify, TooFewNumbersAreAStatusAndNoCertainty) {
  for (const Eigen::Index rows : {1, 2, 5, 9}) {
    const Scene s = scene(23, What::kPositions, rows, {5e-5, 0});
    const Identification result = s.identified();
    EXPECT_EQ(result.status, Status::kTooFewEquations) << rows << " rows";
    EXPECT_TRUE(result.free.empty());
    EXPECT_EQ(result.theta, s.model.start());
    EXPECT_FALSE(result.message.empty());
    expect_finite(result);
  }
  EXPECT_EQ(scene(24, What::kPositions, 12, {5e-5, 0}).identified().status, Status::kConverged);
}

TEST(Identify, FewRowsThatClaimTheirNoiseAreAsSureAsTheyClaim) {
  Scene s = scene(25, What::kPositions, 5, {1e-5, 0});
  s.measured.sigma_position = RowMatrixXd::Constant(5, 3, 1e-5);
  const Identification result = s.identified();
  expect_finite(result);
  EXPECT_EQ(result.rank, 15);
  EXPECT_LE(result.free.size(), 15U);
}

TEST(Identify, WithHardlyAnyDegreeOfFreedomRowsCountByAPlausibleNoise) {
  // Exact rows: what is left of the noise is the plausible one, drawn to by 1 - 3 / 5 of a number beside three.
  const Identification three = scene(29, What::kPositions, 10, {0, 0}).identified();
  ASSERT_EQ(three.degrees_of_freedom, 3);
  EXPECT_NEAR(three.tau[0], 1e-4 * std::sqrt(0.4 / 3.4), 1e-9);
  const Identification nine = scene(29, What::kPositions, 12, {0, 0}).identified();
  ASSERT_EQ(nine.degrees_of_freedom, 9);
  EXPECT_LT(nine.tau[0], 1e-9);
}

TEST(Identify, RowsWithPartsMissingAreUsedForWhatTheyHave) {
  Scene s = scene(26, What::kPoses, 120, {5e-5, 1e-4});
  for (Eigen::Index i = 0; i < 120; ++i) {
    if (i % 4 == 0) s.measured.position(i, i % 3) = kNan;
    if (i % 4 == 1) s.measured.rotation.row(i).setConstant(kNan);
    if (i % 4 == 2) s.measured.position.row(i).setConstant(kNan);
    if (i % 40 == 3) {
      s.measured.position.row(i).setConstant(kNan);
      s.measured.rotation.row(i).setConstant(kNan);
    }
  }
  const Identification result = s.identified();
  EXPECT_EQ(result.status, Status::kConverged) << result.message;
  expect_finite(result);
  EXPECT_EQ(result.rank, 30);
  EXPECT_EQ(result.weights[3].components, 0);
  EXPECT_EQ(result.weights[3].weight, 0);
  EXPECT_EQ(result.weights[0].components, 5);
  EXPECT_TRUE(std::isnan(result.residuals(2, 0)) && !std::isnan(result.residuals(2, 3)));
  Random random(27);
  EXPECT_LT(test::rms_distance(s.model, test::postures(random, 100, 6), result.theta, s.truth), 1e-4);
}

TEST(Identify, NothingMeasuredInAnyRowOrNothingAskedIsSaid) {
  Scene s = scene(28, What::kPositions, 30, {5e-5, 0});
  const Identification nothing_asked = identify({s.model, s.samples, s.measured}, {}, Eigen::VectorXd(), {});
  EXPECT_EQ(nothing_asked.status, Status::kTooFewEquations);
  EXPECT_EQ(nothing_asked.message, "the measurements determine none of the 0 requested parameters");
  EXPECT_EQ(nothing_asked.theta, s.model.start());
  s.measured.position.setConstant(kNan);
  const Identification blind = s.identified();
  EXPECT_EQ(blind.status, Status::kTooFewEquations);
  EXPECT_EQ(blind.message, "nothing was measured in any row");
  expect_finite(blind);
}

}  // namespace
}  // namespace fastcal::test
