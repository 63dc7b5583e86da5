// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The level arm weighs -49.03325 N m on its joint: friction of 1e-5 rad/(N m) holds it 0.4903325 mrad to the side that
// it came to. A joint that moved by 0.2 rad and lacks 1e-3 of its way stands 0.2 mrad short.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"

namespace fastcal::test {
namespace {

TEST(Friction, IsOfTheSizeOfTheLoadAndOfTheSideOfTheApproach) {
  const ErrorModel model = with(level_arm(), {{"friction", "joint1", {1e-5}, {}}}).with_equilibrium(false);
  for (const double q : {0.0, 2 * kHalfPi}) {  // turned over the load has the other sign, its size not
    for (const double side : {1.0, -1.0, 0.0}) {
      Samples samples = posture({q});
      samples.approach = RowMatrixXd::Constant(1, 1, side);
      EXPECT_NEAR(twists(model, samples)(5, joint_frame(0)), side * 4.903325e-4, 1e-18);
    }
  }
}

TEST(Settling, IsAShareOfTheLastMove) {
  const ErrorModel model = with(level_arm(), {{"settling", "joint1", {-1e-3}, {}}});
  Samples samples = posture({0.5});
  EXPECT_EQ(twists(model, samples)(5, joint_frame(0)), 0);  // no move is known
  samples.extra = RowMatrixXd::Constant(1, 1, 0.2);
  EXPECT_NEAR(twists(model, samples)(5, joint_frame(0)), -2e-4, 1e-19);
}

}  // namespace
}  // namespace fastcal::test
