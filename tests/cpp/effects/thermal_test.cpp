// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Steel that is 10 K warmer: 1e-5 / K makes 1 m longer by 0.1 mm. Base, tool and a slider's way do not grow.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "support/robots.hpp"

namespace fastcal::test {
namespace {

constexpr double kGrowth = 1e-5;

Samples warm(const std::vector<double>& q, double kelvin) {
  Samples out = posture(q);
  out.temperature = Eigen::VectorXd::Constant(1, kelvin);
  return out;
}

Options from(double t0) { return {{"t0", t0}}; }

TEST(ThermalExpansion, LengthensTheArmAndNotTheTool) {
  const RobotModel robot = flat_arm(2, {}, {Eigen::Matrix3d::Identity(), {0.5, 0, 0}});
  const ErrorModel model = with(robot, {{"thermal_expansion", "robot", {kGrowth}, from(295)}});
  EXPECT_NEAR(tool(model, warm({0, 0}, 305)).p.x(), 2.5 + 2e-4, 1e-15);
  EXPECT_NEAR(tool(model, warm({0, 2 * kHalfPi}, 305)).p.norm(), 0.5, 1e-15);  // folded: both links grow alike
  EXPECT_NEAR(tool(model, warm({0, 0}, 295)).p.x(), 2.5, 1e-15);
}

TEST(ThermalExpansion, OfOneLinkLeavesTheOther) {
  const ErrorModel model = with(flat_arm(2), {{"thermal_expansion", "link1", {kGrowth}, from(295)}});
  const Pose T = tool(model, warm({0, kHalfPi}, 305));
  EXPECT_NEAR(T.p.x(), 1 + 1e-4, 1e-15);
  EXPECT_NEAR(T.p.y(), 1, 1e-15);
}

TEST(ThermalExpansion, IsTheArmAtAnotherScaleForAllKindsOfFiles) {
  // All lengths of the arm times (1 + s), sliders' travel and tool apart: in the base the flange is at the scaled
  // place.
  Random random(3);
  for (const char* kind : kKinds4) {
    Tables tables = random_tables(random, 5);
    tables.types.assign(5, JointType::kRevolute);
    for (Eigen::Index i = 0; i < 5; ++i) {
      const Eigen::Vector3d axis = random.unit();
      tables.screws.row(i).head<3>() = axis;
      tables.screws.row(i).segment<3>(3) = -axis.cross(random.vector(1));
    }
    tables.tool = {};
    const RobotModel robot = build(kind, tables);
    const std::vector<double> q{0.3, -0.8, 1.1, 0.4, -0.5};
    const Pose cold = tables.base.inverse() * tool(ErrorModel(robot), warm(q, 305));
    const Pose hot =
        tables.base.inverse() * tool(with(robot, {{"thermal_expansion", "robot", {kGrowth}, from(295)}}), warm(q, 305));
    EXPECT_LT((hot.p - (1 + 1e-4) * cold.p).norm(), 1e-14) << kind;
    EXPECT_LT((hot.R - cold.R).norm(), 1e-14) << kind;
  }
}

TEST(ThermalExpansion, ASlidersWayDoesNotGrow) {
  RobotDescription description;
  description.joint_types = {JointType::kPrismatic};
  const RobotModel robot = build_dh(description, one_row(0, 1, 0));  // d = 1 m, the way on top of it
  const ErrorModel model = with(robot, {{"thermal_expansion", "robot", {kGrowth}, from(295)}});
  EXPECT_NEAR(tool(model, warm({3}, 305)).p.z(), 4 + 1e-4, 1e-15);
}

TEST(ThermalOffset, ShiftsTheJointsZero) {
  const ErrorModel model = with(flat_arm(2), {{"thermal_offset", "joint2", {2e-5}, from(293.15)}});
  EXPECT_NEAR(heading(tool(model, warm({0.3, 0.4}, 303.15))), 0.7 + 2e-4, 1e-15);
  EXPECT_NEAR(heading(tool(model, warm({0.3, 0.4}, 283.15))), 0.7 - 2e-4, 1e-15);
}

TEST(ThermalOffset, LooksAtTheFilteredTemperatureWhereItLags) {
  const Options late{{"t0", 290.0}, {"lag", 600.0}, {"index", 1.0}};
  Samples samples = posture({0.3, 0.4});
  samples.temperature = Eigen::VectorXd::Constant(1, 300);
  samples.extra = RowMatrixXd::Zero(1, 2);
  samples.extra(0, 1) = 294;
  EXPECT_NEAR(heading(tool(with(flat_arm(2), {{"thermal_offset", "joint2", {1e-5}, late}}), samples)), 0.7 + 4e-5,
              1e-15);
  EXPECT_THROW(make_effect("thermal_offset", flat_arm(2), "joint2", {{"lag", 600.0}}), InvalidInput);
  EXPECT_THROW(make_effect("thermal_offset", flat_arm(2), "joint2", {{"lag", -1.0}}), InvalidInput);
}

TEST(ThermalSpring, TurnsTheJointByTemperatureTimesItsPosition) {
  const ErrorModel model = with(flat_arm(2), {{"thermal_spring", "joint2", {1e-5, 2e-5, -3e-5}, from(293.15)}});
  const double slope = 1e-5 + 2e-5 * std::sin(0.4) - 3e-5 * std::cos(0.4);
  EXPECT_NEAR(heading(tool(model, warm({0.3, 0.4}, 303.15))), 0.7 + 10 * slope, 1e-15);
  EXPECT_NEAR(heading(tool(model, warm({0.3, 0.4}, 293.15))), 0.7, 1e-15);
}

TEST(ThermalBending, IsAnArcAlongTheLink) {
  // An arc of 1 m that turns by t: its end lies t / 2 aside, and the next link goes on at t.
  const double t = 1e-4;
  const ErrorModel model = with(flat_arm(2), {{"thermal_bending", "link1", {0, 0, t / 10}, from(293.15)}});
  const Pose T = tool(model, warm({0, 0}, 303.15));
  EXPECT_NEAR(heading(T), t, 1e-15);
  EXPECT_NEAR(T.p.y(), t / 2 + t, 1e-8);
}

TEST(ThermalBending, IsGoneOnceTheHeatIsThrough) {
  const Options late{{"t0", 290.0}, {"lag", 600.0}, {"index", 0.0}};
  Samples samples = warm({0, 0}, 300);
  samples.extra = RowMatrixXd::Constant(1, 1, 300);
  const ErrorModel model = with(flat_arm(2), {{"thermal_bending", "link1", {0, 0, 1e-5}, late}});
  EXPECT_NEAR(heading(tool(model, samples)), 0, 1e-15);
  samples.extra(0, 0) = 296;
  EXPECT_NEAR(heading(tool(model, samples)), 4e-5, 1e-15);
}

}  // namespace
}  // namespace fastcal::test
