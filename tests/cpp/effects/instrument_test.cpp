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

}  // namespace
}  // namespace fastcal::test
