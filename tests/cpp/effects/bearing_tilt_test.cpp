// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An arm of 1 m on an upright axis: 10 kg at its end load the bearing with 98.0665 N m; at 1e-6 rad/(N m) it tilts
// by 9.80665e-5 rad.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"

namespace fastcal::test {
namespace {

TEST(BearingTilt, TiltsTheJointAcrossItsAxis) {
  RobotDescription description;
  description.joint_types = {JointType::kRevolute};
  const RobotModel robot = build_dh(description, one_row(0, 0, 1));
  for (const double q : {0.0, 0.9, -2.0}) {
    const ErrorModel model = with(robot, {{"bearing_tilt", "joint1", {1e-6}, {}}}).with_equilibrium(false);
    const Pose T = tool(model, posture({q}, 10));
    const double tilt = 98.0665e-6;
    EXPECT_NEAR(T.p.z(), -std::sin(tilt), 1e-16) << q;  // down, wherever it points
    EXPECT_NEAR(T.p.head<2>().norm(), std::cos(tilt), 1e-15);
    EXPECT_NEAR(std::atan2(T.p.y(), T.p.x()), q, 1e-15);
  }
}

TEST(BearingTilt, TheMomentAboutTheAxisDoesNotTilt) {
  const ErrorModel model = with(level_arm(), {{"bearing_tilt", "joint1", {1e-6}, {}}});
  EXPECT_NEAR(twists(model, posture({0.3}, 10)).norm(), 0, 1e-18);
}

}  // namespace
}  // namespace fastcal::test
