// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The base moves in the measuring frame's axes, however it stands there; it turns about its own origin.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

Samples at(double time, int station = -1) {
  Samples out = posture({0});
  out.time = Eigen::VectorXd::Constant(1, time);
  out.station = Eigen::VectorXi::Constant(1, station);
  return out;
}

// A base that looks along the measuring frame's y axis, at (2, 0, 0): the tool is at (2, 1, 0).
RobotModel placed() {
  Pose base = turned_base(kHalfPi);
  base.p = {2, 0, 0};
  return flat_arm(1, base);
}

void expect_near(const Eigen::Vector3d& got, const Eigen::Vector3d& expected) {
  EXPECT_LT((got - expected).norm(), 1e-15) << got.transpose();
}

TEST(BaseDrift, MovesSteadilyAlongTheMeasuringAxes) {
  const ErrorModel model = with(placed(), {{"base_drift", "base", {1e-6, 2e-6, -1e-6, 0, 0, 0}, {{"t0", 100.0}}}});
  expect_near(tool(model, at(100)).p, {2, 1, 0});
  expect_near(tool(model, at(200)).p, {2 + 1e-4, 1 + 2e-4, -1e-4});
  expect_near(tool(model, at(0)).p, {2 - 1e-4, 1 - 2e-4, 1e-4});
}

TEST(BaseDrift, StandsStillBeforeAndAfterTheTimesThatWereMeasured) {
  const Options session{{"t0", 100.0}, {"first", 50.0}, {"last", 200.0}};
  const ErrorModel model = with(placed(), {{"base_drift", "base", {1e-6, 0, 0, 0, 0, 0}, session}});
  expect_near(tool(model, at(0)).p, {2 - 5e-5, 1, 0});
  expect_near(tool(model, at(60)).p, {2 - 4e-5, 1, 0});
  expect_near(tool(model, at(200)).p, {2 + 1e-4, 1, 0});
  expect_near(tool(model, at(1e6)).p, {2 + 1e-4, 1, 0});
  EXPECT_THROW(make_effect("base_drift", placed(), "base", {{"first", 2.0}, {"last", 1.0}}), InvalidInput);
}

TEST(BaseDrift, TurnsAboutTheBasesOrigin) {
  const ErrorModel model = with(placed(), {{"base_drift", "base", {0, 0, 0, 0, 0, 1e-6}, {}}});
  expect_near(tool(model, at(1000)).p, {2 - std::sin(1e-3), std::cos(1e-3), 0});
  const ErrorModel pitch =
      with(placed(), {{"base_drift", "base", {0, 0, 0, 1e-6, 0, 0}, {}}});  // about the measuring x axis
  expect_near(tool(pitch, at(1000)).p, {2, std::cos(1e-3), std::sin(1e-3)});
}

TEST(BaseStep, IsThereFromItsMomentOn) {
  const ErrorModel model = with(placed(), {{"base_step", "base", {1e-4, 0, 0, 0, 0, 0}, {{"at", 50.0}}}});
  expect_near(tool(model, at(49.999)).p, {2, 1, 0});
  expect_near(tool(model, at(50)).p, {2 + 1e-4, 1, 0});
  expect_near(tool(model, at(1e6)).p, {2 + 1e-4, 1, 0});
}

TEST(BaseStep, IsThereByTheOrderOfRowsWhereTheyHaveNoTime) {
  const Options third{{"at_row", 3.0}, {"rows", 8.0}, {"index", 1.0}};
  const ErrorModel model = with(placed(), {{"base_step", "base", {1e-4, 0, 0, 0, 0, 0}, third}});
  Samples samples = posture({0});
  samples.extra = RowMatrixXd::Zero(1, 2);
  expect_near(tool(model, samples).p, {2, 1, 0});
  samples.extra(0, 1) = 1;
  expect_near(tool(model, samples).p, {2 + 1e-4, 1, 0});
  samples.extra(0, 1) = 0.25;
  expect_near(tool(model, samples).p, {2 + 0.25e-4, 1, 0});
  EXPECT_THROW(make_effect("base_step", placed(), "base", {{"at_row", 3.0}}), InvalidInput);
  EXPECT_THROW(make_effect("base_step", placed(), "base", {{"at_row", 3.0}, {"index", 0.0}, {"at", 1.0}}),
               InvalidInput);
}

TEST(BaseSettling, IsFastAtFirstAndComesToRest) {
  const ErrorModel model =
      with(placed(), {{"base_settling", "base", {1e-4, 0, 0, 0, 0, 0}, {{"begins", 100.0}, {"tau", 50.0}}}});
  expect_near(tool(model, at(20)).p, {2, 1, 0});
  expect_near(tool(model, at(100)).p, {2, 1, 0});
  expect_near(tool(model, at(150)).p, {2 + 1e-4 * (1 - std::exp(-1.0)), 1, 0});
  expect_near(tool(model, at(1e6)).p, {2 + 1e-4, 1, 0});
  EXPECT_THROW(make_effect("base_settling", placed(), "base", {}), InvalidInput);
  EXPECT_THROW(make_effect("base_settling", placed(), "base", {{"tau", -1.0}}), InvalidInput);
}

TEST(ThermalBase, MovesAlongTheMeasuringAxesWithTheTemperature) {
  const ErrorModel model = with(placed(), {{"thermal_base", "base", {1e-5, 0, -2e-5, 0, 0, 0}, {{"t0", 290.0}}}});
  Samples samples = posture({0});
  samples.temperature = Eigen::VectorXd::Constant(1, 300);
  expect_near(tool(model, samples).p, {2 + 1e-4, 1, -2e-4});
}

TEST(StationOffset, MovesTheBaseFromTheSecondStationOn) {
  const Options three{{"count", 3.0}};
  const ErrorModel model =
      with(placed(), {{"station_offset", "base", {1e-4, 0, 0, 0, 0, 0, 0, 3e-4, 0, 0, 0, 0}, three}});
  expect_near(tool(model, at(0, 0)).p, {2, 1, 0});
  expect_near(tool(model, at(0, 1)).p, {2 + 1e-4, 1, 0});
  expect_near(tool(model, at(0, 2)).p, {2, 1 + 3e-4, 0});
  EXPECT_EQ(model.effects()[0]->parameters()[6].name, "station3_x");
  EXPECT_THROW(make_effect("station_offset", placed(), "base", {{"count", 1.0}}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
