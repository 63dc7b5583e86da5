// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Columns of a user's own: a tilt sensor that reads 2 (mrad) turns the base by 2 mrad at a coefficient of 1e-3.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "effects/loaded.hpp"
#include "fastcal/effects/tabulated_effect.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

Samples with_extra(const std::vector<double>& q, double first, double second) {
  Samples out = posture(q);
  out.extra.resize(1, 2);
  out.extra << first, second;
  return out;
}

TEST(Regressor, MovesAFrameByItsColumn) {
  const Options tilt{{"column", std::string("tilt")}, {"index", 1.0}, {"axis", std::string("rz")}};
  const ErrorModel model = with(flat_arm(2), {{"regressor", "base", {1e-3}, tilt}});
  EXPECT_NEAR(heading(tool(model, with_extra({0.3, 0.4}, 100, 2))), 0.7 + 2e-3, 1e-15);
  EXPECT_EQ(model.effects()[0]->parameters()[0].name, "tilt_rz");
}

TEST(Regressor, HasAllSixMotionsWhereNoAxisIsGiven) {
  const Options options{{"column", std::string("c")}};
  const ErrorModel model = with(flat_arm(2), {{"regressor", "link1", {1e-3, 0, 5e-4, 0, 0, 0}, options}});
  const Eigen::Vector3d at = tool(model, with_extra({kHalfPi, 0}, 2, 0)).p;
  EXPECT_LT((at - Eigen::Vector3d(0, 2 + 2e-3, 1e-3)).norm(), 1e-15);
}

TEST(Regressor, NeedsItsColumn) {
  EXPECT_THROW(make_effect("regressor", flat_arm(1), "base", {}), InvalidInput);
  EXPECT_THROW(
      make_effect("regressor", flat_arm(1), "base", {{"column", std::string("c")}, {"axis", std::string("w")}}),
      InvalidInput);
  const ErrorModel model =
      with(flat_arm(1), {{"regressor", "base", std::vector<double>(6, 0.0), {{"column", std::string("c")}}}});
  EXPECT_THROW(tool(model, posture({0})), InvalidInput);
}

TEST(TabulatedEffect, LooksItsBasisUp) {
  // Two parameters on two frames, behind three foreign columns: (joint1: 1st, 2nd; tool: 1st, 2nd), six numbers each.
  const RobotModel robot = flat_arm(2);
  const auto effect = std::make_shared<TabulatedEffect>(
      std::vector<Parameter>{{"joint1", "a", "rad", 1e-3, "a"}, {"joint1", "b", "m", 1e-3, "b"}},
      std::vector<int>{joint_frame(0), tool_frame(2)}, 3);
  EXPECT_EQ(effect->width(), 24);
  Samples samples = posture({0.3, 0.4});
  samples.table = RowMatrixXd::Zero(1, 27);
  samples.table(0, 3 + 5) = 1;        // joint1 turns by a
  samples.table(0, 3 + 6 * 3) = 0.5;  // the tool moves along its x by b / 2
  const Pose moved = tool(ErrorModel(robot, {effect}, Eigen::Vector2d(1e-3, 4e-3)), samples);
  const Pose turned = tool(ErrorModel(robot), posture({0.301, 0.4}));
  EXPECT_LT((moved.p - (turned.p + 2e-3 * turned.R.col(0))).norm(), 1e-15);
  EXPECT_THROW(TabulatedEffect({}, {0}, 0), InvalidInput);
  EXPECT_THROW(TabulatedEffect({{"base", "a", "rad", 0, "no size"}}, {0}, 0), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
