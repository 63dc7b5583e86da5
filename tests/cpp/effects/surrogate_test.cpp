// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One node at 0.5 rad of width 0.2: 1 mrad there, exp(-1/2) of it 0.2 rad away, fading beyond 0.9 rad to 0 at 1.1.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal::test {
namespace {

using List = std::vector<double>;

Options one_node(List weights = {1e-3}) {
  return {{"inputs", std::string("q2")}, {"low", List{0}},     {"high", List{0.9}},
          {"width", List{0.2}},          {"nodes", List{0.5}}, {"weights", std::move(weights)}};
}

double turn(double q2) {
  return heading(tool(with(flat_arm(2), {{"surrogate", "joint1", {1}, one_node()}}), posture({0, q2}))) - q2;
}

TEST(Surrogate, IsASumOfBellsThatFadesOutsideItsData) {
  EXPECT_NEAR(turn(0.5), 1e-3, 1e-15);
  EXPECT_NEAR(turn(0.7), 1e-3 * std::exp(-0.5), 1e-15);
  EXPECT_NEAR(turn(1.0), 1e-3 * std::exp(-3.125) / 2, 1e-15);
  EXPECT_NEAR(turn(1.1), 0, 1e-15);
}

TEST(Surrogate, MovesTheGeometryWithIt) {
  Pose base = turned_base(0.4);
  base.p = {1, 2, 0.3};
  const RobotModel robot = flat_arm(2, base);
  const auto count = robot.parameters().size();
  for (std::size_t k = 0; k < count; ++k) {
    Options options = one_node({0.0});
    List shift(count, 0.0);
    shift[k] = 1e-7;
    options["shift"] = shift;
    const Pose seen = tool(with(robot, {{"surrogate", "joint1", {1}, options}}), posture({0.2, 0.5}));
    Eigen::VectorXd values = robot.nominal();
    values[static_cast<Eigen::Index>(k)] += 1e-7;
    double T[16];
    predict(ErrorModel(robot), posture({0.2, 0.5}), values, 1, T);
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> M(T);
    EXPECT_LT((seen.p - M.topRightCorner<3, 1>()).norm(), 1e-13) << robot.parameters()[k].name;
    EXPECT_LT((seen.R - M.topLeftCorner<3, 3>()).norm(), 1e-13) << robot.parameters()[k].name;
  }
}

TEST(Surrogate, MovesEachPlaceAlongItsDirections) {
  Pose base = turned_base(0.4);
  base.p = {3, 2, 1};
  const RobotModel robot = flat_arm(2, base);
  const Samples samples = posture({0.3, 0.5});
  const Pose there = tool(ErrorModel(robot), samples);
  const auto moved = [&](const std::string& place, const List& weights) -> Eigen::Vector3d {
    return tool(with(robot, {{"surrogate", place, {1}, one_node(weights)}}), samples).p - there.p;
  };
  EXPECT_LT((moved("workspace", {1e-3, 2e-3, 3e-3}) - Eigen::Vector3d(1e-3, 2e-3, 3e-3)).norm(), 1e-15);
  EXPECT_LT((moved("instrument", {0, 0, 1e-3}) - 1e-3 * there.p.normalized()).norm(), 1e-15);
  EXPECT_LT((moved("robot", {1e-3}) - 1e-3 * (there.p - base.p)).norm(), 1e-15);
  EXPECT_LT((moved("tool", {1e-3, 0, 0, 0, 0, 0}) - 1e-3 * there.R.col(0)).norm(), 1e-15);
  EXPECT_LT((moved("base", {0, 0, 0, 0, 0, 1e-8}) - 1e-8 * Eigen::Vector3d::UnitZ().cross(there.p - base.p)).norm(),
            1e-15);
}

TEST(Surrogate, RefusesWhatDoesNotFit) {
  Options options = one_node({1, 2});
  options["nodes"] = List{0.5};
  EXPECT_THROW(make_effect("surrogate", flat_arm(2), "joint1", options), InvalidInput);
  options = one_node();
  options["inputs"] = std::string("q3");
  EXPECT_THROW(make_effect("surrogate", flat_arm(2), "joint1", options), InvalidInput);
  options = one_node();
  options["shift"] = List{1};
  EXPECT_THROW(make_effect("surrogate", flat_arm(2), "joint1", options), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
