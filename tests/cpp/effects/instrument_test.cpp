// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The instrument's side: a target that is mounted anew, lengths that are all wrong by the same share.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

TEST(ToolShift, IsAlongTheToolsAxes) {
  const Options three{{"count", 3.0}};
  const ErrorModel model = with(flat_arm(1), {{"tool_shift", "tool", {1e-4, 0, 2e-4, 0, 3e-4, 0}, three}});
  const Eigen::Vector3d expected[3] = {
      {0, 1, 0}, {0, 1 + 1e-4, 2e-4}, {-3e-4, 1, 0}};  // at 90 degrees the tool's x is the measuring y
  for (int mount = 0; mount < 3; ++mount) {
    Samples samples = posture({kHalfPi});
    samples.mount = Eigen::VectorXi::Constant(1, mount);
    EXPECT_LT((tool(model, samples).p - expected[mount]).norm(), 1e-15) << mount;
  }
  EXPECT_THROW(make_effect("tool_shift", flat_arm(1), "tool", {{"count", 1.0}}), InvalidInput);
}

// A screw about and along the tool's own z, by any angle: that is where the target goes.
TEST(ToolShift, OfAPoseTurnsTheTarget) {
  const double turn = 2.5, lift = 0.03;
  const Options two{{"count", 2.0}, {"target", std::string("pose")}};
  const ErrorModel model = with(flat_arm(1), {{"tool_shift", "tool", {0, 0, lift, 0, 0, turn}, two}});
  Samples samples = posture({0.4});
  samples.mount = Eigen::VectorXi::Zero(1);
  const Pose first = tool(model, samples);
  samples.mount.setConstant(1);
  const Pose second = tool(model, samples);
  EXPECT_LT((second.p - first.p - first.R.col(2) * lift).norm(), 1e-15);
  const Eigen::AngleAxisd about_z(turn, Eigen::Vector3d::UnitZ());
  EXPECT_LT((second.R - first.R * about_z.toRotationMatrix()).norm(), 1e-14);
  EXPECT_THROW(make_effect("tool_shift", flat_arm(1), "tool", {{"target", std::string("ball")}}), InvalidInput);
}

TEST(MeasurementScale, ScalesWhatIsMeasuredAboutTheInstrument) {
  Pose base = turned_base(0.3);
  base.p = {3, -2, 0.5};
  const RobotModel robot = flat_arm(2, base);
  const std::vector<double> q{0.4, -0.9};
  const Pose truth = tool(ErrorModel(robot), posture(q));
  for (const double error : {2e-5, -1e-3, 0.02}) {
    const Pose seen = tool(with(robot, {{"measurement_scale", "instrument", {error}, {}}}), posture(q));
    EXPECT_LT((seen.p - (1 + error) * truth.p).norm(), 1e-13) << error;
    EXPECT_LT((seen.R - truth.R).norm(), 1e-14);
  }
}

TEST(MeasurementScale, ScalesTheDeflectedArm) {
  const std::vector<Cause> yielding{{"joint_compliance", "joint1", {1e-5}, {}}};
  std::vector<Cause> scaled = yielding;
  scaled.push_back({"measurement_scale", "instrument", {1e-3}, {}});
  const Pose truth = tool(with(level_arm(), yielding), posture({0.2}));
  EXPECT_LT((tool(with(level_arm(), scaled), posture({0.2})).p - 1.001 * truth.p).norm(), 1e-14);
}

TEST(TrackerRange, AddsToEachLengthAndScalesItFromTheInstrument) {
  Pose base = turned_base(0.3);
  base.p = {3, -2, 0.5};
  const std::vector<double> q{0.4, -0.9};
  const Eigen::Vector3d truth = tool(ErrorModel(flat_arm(2, base)), posture(q)).p;
  const Eigen::Vector3d seen =
      tool(with(flat_arm(2, base), {{"tracker_range", "instrument", {2e-3, 1e-4}, {}}}), posture(q)).p;
  EXPECT_LT((seen - truth.normalized() * (1.0001 * truth.norm() + 2e-3)).norm(), 1e-12);
}

TEST(TrackerRange, HasOneOfEachStation) {
  Pose base;
  base.p = {3, 0, 0};
  const ErrorModel model =
      with(flat_arm(1, base), {{"tracker_range", "instrument", {1e-3, 0, 5e-3, 0}, {{"count", 2.0}}}});
  for (int station = 0; station < 2; ++station) {
    Samples samples = posture({0});
    samples.station = Eigen::VectorXi::Constant(1, station);
    EXPECT_NEAR(tool(model, samples).p.x(), station == 0 ? 4.001 : 4.005, 1e-14);
  }
}

TEST(ToolStep, MovesTheToolAlongItsOwnAxesFromItsMomentOn) {
  const ErrorModel model = with(flat_arm(1), {{"tool_step", "tool", {1e-4, 0, 2e-4, 0, 0, 1e-3}, {{"at", 50.0}}}});
  Samples samples = posture({kHalfPi});
  samples.time = Eigen::VectorXd::Constant(1, 49.9);
  EXPECT_LT((tool(model, samples).p - Eigen::Vector3d(0, 1, 0)).norm(), 1e-15);
  samples.time[0] = 50;
  const Pose moved = tool(model, samples);
  EXPECT_NEAR(heading(moved), kHalfPi + 1e-3, 1e-15);
  // A twist: along an arc of 1e-3 rad; at 90 degrees the tool's x is the measuring y.
  EXPECT_LT((moved.p - Eigen::Vector3d(-5e-8, 1 + 1e-4, 2e-4)).norm(), 1e-10);
}

TEST(ToolStep, IsThereWhereNobodyKnowsWhen) {
  const ErrorModel model = with(flat_arm(1), {{"tool_step", "tool", {1e-4, 0, 0, 0, 0, 0}, {{"at", 50.0}}}});
  EXPECT_NEAR(tool(model, posture({0})).p.x(), 1 + 1e-4, 1e-15);
}

TEST(ZeroStep, TurnsTheJointFromItsMomentOn) {
  const ErrorModel model = with(flat_arm(2), {{"zero_step", "joint2", {2e-3}, {{"at", 50.0}}}});
  Samples samples = posture({0.3, 0.4});
  for (const double time : {0.0, 49.0, 50.0, 1e5}) {
    samples.time = Eigen::VectorXd::Constant(1, time);
    EXPECT_NEAR(heading(tool(model, samples)), time < 50 ? 0.7 : 0.702, 1e-15) << time;
  }
}

TEST(RangeStep, AddsToEachLengthFromItsMomentOn) {
  Pose base = turned_base(0.3);
  base.p = {3, -2, 0.5};
  const Eigen::Vector3d truth = tool(ErrorModel(flat_arm(2, base)), posture({0.4, -0.9})).p;
  const ErrorModel model = with(flat_arm(2, base), {{"range_step", "instrument", {2e-4}, {{"at", 50.0}}}});
  Samples samples = posture({0.4, -0.9});
  samples.time = Eigen::VectorXd::Constant(1, 10);
  EXPECT_LT((tool(model, samples).p - truth).norm(), 1e-15);
  samples.time[0] = 60;
  EXPECT_LT((tool(model, samples).p - truth.normalized() * (truth.norm() + 2e-4)).norm(), 1e-14);
}

TEST(RangeWave, RepeatsWithTheLength) {
  Pose base;
  base.p = {3, 0, 0};  // the tool: 4 m off
  for (const double period : {16.0, 8.0, 0.4}) {
    const ErrorModel model =
        with(flat_arm(1, base), {{"range_wave", "instrument", {3e-4, 1e-4}, {{"period", period}}}});
    const double seen = tool(model, posture({0})).p.x();
    const double angle = 4 * kHalfPi * seen / period;  // of the length that is read
    EXPECT_NEAR(seen, 4 + 3e-4 * std::sin(angle) + 1e-4 * std::cos(angle), 1e-14) << period;
    EXPECT_GT(std::abs(seen - 4), 5e-5) << period;
  }
  EXPECT_THROW(make_effect("range_wave", flat_arm(1), "instrument", {}), InvalidInput);
}

TEST(TrackerAngle, TurnsTheReadingOfEachCircle) {
  Pose base;
  base.p = {2, 0, 2};  // the tool of a straight arm: (3, 0, 2)
  const RobotModel robot = flat_arm(1, base);
  const double r = std::sqrt(13.0);
  // Azimuth 0: its sine does nothing, its cosine turns by 1e-5 about z; elevation e: tan e = 2 / 3.
  const Eigen::Vector3d expected[4] = {{0, 0, 0}, {0, 3e-5, 0}, {-4e-5 / r, 0, 6e-5 / r}, {-6e-5 / r, 0, 9e-5 / r}};
  for (std::size_t k = 0; k < 4; ++k) {
    std::vector<double> values(4, 0.0);
    values[k] = 1e-5;
    const Eigen::Vector3d moved =
        tool(with(robot, {{"tracker_angle", "instrument", values, {}}}), posture({0})).p - Eigen::Vector3d(3, 0, 2);
    EXPECT_LT((moved - expected[k]).norm(), 4 * 1e-5 * 1e-5) << k;  // of second order in the turn
  }
}

}  // namespace
}  // namespace fastcal::test
