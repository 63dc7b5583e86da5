// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Joint compliance: a level arm of 1 m, 10 kg in its middle: load -49.03325 N m about an axis that lifts it.
#include <gtest/gtest.h>

#include <cmath>

#include "effects/loaded.hpp"

namespace fastcal::test {
namespace {

TEST(JointCompliance, TurnsTheJointAlongItsLoad) {
  const ErrorModel model = with(level_arm(), {{"joint_compliance", "joint1", {1e-5}, {}}}).with_equilibrium(false);
  const Pose T = tool(model, posture({0}));
  EXPECT_NEAR(T.p.z(), -std::sin(4.903325e-4), 1e-15);
  EXPECT_NEAR(T.p.x(), std::cos(4.903325e-4), 1e-15);
  EXPECT_NEAR(T.p.y(), 0, 1e-15);
}

TEST(JointCompliance, EquilibriumTakesTheLeverOfTheDeflectedArm) {
  // A joint so soft that it matters: dq = -c m g (L / 2) cos(dq), by bisection.
  const double c = 1e-2;
  double low = -1, high = 0;
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (middle + c * 49.03325 * std::cos(middle) > 0 ? high : low) = middle;
  }
  EXPECT_LT(low, -0.4);
  const ErrorModel model = with(level_arm(), {{"joint_compliance", "joint1", {c}, {}}});
  const Pose T = tool(model, posture({0}));
  EXPECT_NEAR(std::atan2(T.p.z(), T.p.x()), low, 1e-13);
}

TEST(JointCompliance, APrismaticJointGivesAlongItsForce) {
  RobotDescription description;
  description.joint_types = {JointType::kPrismatic};
  description.bodies.resize(1);
  description.bodies[0].mass = 10;
  const ErrorModel model = with(build_dh(description, one_row(0, 0, 0)), {{"joint_compliance", "joint1", {1e-6}, {}}});
  EXPECT_EQ(model.parameters().back().unit, "m_n");
  EXPECT_NEAR(tool(model, posture({0.3}, 5)).p.z(), 0.3 - 15 * kG * 1e-6, 1e-15);
}

TEST(JointCompliance, WrenchesLoadItAtThePayloadsCentre) {
  RobotDescription description = level_description();
  description.bodies[0].mass = 0;
  description.p_flange_payload = {0.2, 0, 0};
  description.wrench_frame = WrenchFrame::kFlange;
  const ErrorModel model =
      with(level_arm(description), {{"joint_compliance", "joint1", {1e-5}, {}}}).with_equilibrium(false);
  Samples samples = posture({0.4});
  samples.wrench = RowMatrixXd::Zero(1, 6);
  samples.wrench(0, 1) = 100;  // across the arm, in flange axes: y is where the joint turns to
  samples.wrench(0, 5) = 7;    // 100 N at 1.2 m and 7 N m
  EXPECT_NEAR(twists(model, samples)(5, joint_frame(0)), 127e-5, 1e-16);
}

TEST(JointCompliance, AgainstItsLoadItTurnsBack) {
  RobotDescription description = level_description();
  description.p_flange_payload = {0.1, 0, 0};
  const Options against{{"sign", std::string("against")}};
  const Twists along =
      twists(with(level_arm(description), {{"joint_compliance", "joint1", {1e-5}, {}}}), posture({0}, 20));
  const Twists back =
      twists(with(level_arm(description), {{"joint_compliance", "joint1", {1e-5}, against}}), posture({0}, 20));
  EXPECT_LT(along(5, joint_frame(0)), -1e-3);
  EXPECT_NEAR(back(5, joint_frame(0)), -along(5, joint_frame(0)), 1e-3 * back(5, joint_frame(0)));  // other postures
  EXPECT_THROW(make_effect("joint_compliance", level_arm(), "joint1", {{"sign", std::string("up")}}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
