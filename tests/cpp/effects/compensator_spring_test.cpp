// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A spring of 10 kN/m, 0.2 m long when free, from an anchor at (0, 0.3) to an arm at (0.4, 0) of the joint: at q = 0 it
// is 0.5 m long, pulls with 3000 N and turns the joint by 0.4 m * 3000 N * 0.3 / 0.5 = 720 N m.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/robot/statics.hpp"

namespace fastcal::test {
namespace {

RobotDescription sprung() {
  RobotDescription description = level_description();
  description.compensator = Compensator{0, {0, 0.3, 0}, {0.4, 0, 0}, 1e4, 0.2};
  return description;
}

/// Load about the joint's axis.
double load(const RobotModel& robot, double q) {
  const ErrorModel model = with(robot, {{"joint_compliance", "joint1", {0}, {}}});
  Samples samples = posture({q});
  settle(model, model.start(), 1, samples);
  return samples.load(0, 6 * joint_frame(0) + 5);
}

TEST(CompensatorSpring, ItsMomentIsPartOfTheJointsLoad) {
  EXPECT_NEAR(load(level_arm(sprung()), 0), 720 - 49.03325, 1e-11);
  EXPECT_NEAR(load(level_arm(sprung()), kHalfPi), 0, 1e-11);                    // arm, anchor and axis in one line
  EXPECT_NEAR(load(level_arm(sprung()), 2 * kHalfPi), -720 + 49.03325, 1e-11);  // the other side of it
}

TEST(CompensatorSpring, AnOffsetOfTheJointMovesTheArmAndNotTheAnchor) {
  // The frame in which both are given is the joint's at position 0, offset included.
  EXPECT_NEAR(load(build_dh(sprung(), one_row(kHalfPi, 0, 1)), 0), 720, 1e-11);
}

TEST(CompensatorSpring, FramesBeforeTheJointDoNotFeelIt) {
  const ErrorModel model = with(level_arm(sprung()), {{"joint_compliance", "joint1", {0}, {}}});
  Samples samples = posture({0.3});
  settle(model, model.start(), 1, samples);
  RobotDescription bare = sprung();
  bare.compensator.reset();
  const ErrorModel without = with(level_arm(bare), {{"joint_compliance", "joint1", {0}, {}}});
  Samples other = posture({0.3});
  settle(without, without.start(), 1, other);
  EXPECT_EQ(samples.load.leftCols(6), other.load.leftCols(6));
}

TEST(CompensatorSpring, ItsErrorActsThroughTheJointsCompliance) {
  const RobotModel robot = level_arm(sprung());
  const auto turned = [&](double scale) {
    const ErrorModel model =
        with(robot, {{"joint_compliance", "joint1", {1e-6}, {}}, {"compensator_spring", "joint1", {scale}, {}}});
    return twists(model.with_equilibrium(false), posture({0}))(5, joint_frame(0));
  };
  EXPECT_NEAR(turned(0), (720 - 49.03325) * 1e-6, 1e-15);
  EXPECT_NEAR(turned(0.1), (792 - 49.03325) * 1e-6, 1e-15);
}

TEST(CompensatorSpring, HasNoOwnerWhereThereIsNoSpring) {
  EXPECT_TRUE(effect_entry("compensator_spring").owners(level_arm()).empty());
  EXPECT_EQ(effect_entry("compensator_spring").owners(level_arm(sprung())), std::vector<std::string>{"joint1"});
  EXPECT_THROW(make_effect("compensator_spring", level_arm(), "joint1", {}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
