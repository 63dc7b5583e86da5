// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Residuals and derivatives of an arm whose loads follow what carries them.
#include "fastcal/identification/load_response.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "fastcal/identification/identify.hpp"
#include "fastcal/model/settle.hpp"
#include "identification/twisted_arm.hpp"

namespace fastcal {
namespace {

using test::Random;
using test::twisted_arm;

struct Scene {
  ErrorModel model = twisted_arm();
  Samples samples;
  test::Measured measured;
  std::vector<int> free;
  Eigen::VectorXd scale;

  explicit Scene(std::uint64_t seed) {
    Random random(seed);
    samples = test::postures(random, 200, 6);
    settle(model, model.start(), 1, samples);
    measured = test::measure(random, model, samples, model.start(), test::What::kPositions, {3e-5, 0});
    for (const char* name : {"joint2 d", "joint3 d", "joint2 a"}) free.push_back(test::index_of(model, name));
    scale = Eigen::VectorXd::Constant(3, 1e-3);
  }
  Problem problem() const { return {model, samples, measured, 1}; }
};

RowMatrixXd settled_residuals(const Scene& s, const Eigen::VectorXd& theta) {
  Samples samples = s.samples;
  settle(s.model, theta, 1, samples);
  return residuals({s.model, samples, s.measured, 1}, theta).leftCols(3);
}

TEST(LoadResponse, MakesTheResidualsThoseOfTheSettledArm) {
  const Scene s(1);
  const CommonNoise tau{1e-3, 1e-3, 1e-3};  // so much that opposite offsets are weak
  const Eigen::VectorXd theta = s.model.start();
  const Eigen::MatrixXd factor = triangular_factor(s.problem(), theta, s.free, s.scale, {tau});
  const auto response = load_response(s.problem(), theta, s.free, s.scale, factor);
  ASSERT_TRUE(response);
  ASSERT_EQ(response->change.size(), 1u);
  Problem following = s.problem();
  following.response = &*response;

  Eigen::VectorXd there = theta;
  there[s.free[0]] += 2e-3;
  there[s.free[1]] -= 2e-3;
  const RowMatrixXd settled = settled_residuals(s, there);
  const double fixed_misses = (residuals(s.problem(), there).leftCols(3) - settled).norm();
  const double following_misses = (residuals(following, there).leftCols(3) - settled).norm();
  EXPECT_GT(fixed_misses, 0.3 * (settled - settled_residuals(s, theta)).norm());
  EXPECT_LT(following_misses, 0.02 * fixed_misses);

  // The derivative that the solver sees is that of these residuals.
  const auto cost = [&](double step) {
    Eigen::VectorXd near = there;
    near[s.free[0]] += step * s.scale[0];
    return normal_equations(following, near, s.free, s.scale, {tau, LossKind::kNone}, false).cost;
  };
  const NormalEquations at = normal_equations(following, there, s.free, s.scale, {tau, LossKind::kNone}, true);
  EXPECT_NEAR(at.g[0], (cost(1e-2) - cost(-1e-2)) / 2e-2, 1e-6 * std::abs(at.g[0]));
}

TEST(LoadResponse, ThereIsNoneWhereAllIsToldWell) {
  const Scene s(2);
  const CommonNoise tau{1e-7, 1e-7, 1e-7};
  const Eigen::MatrixXd factor = triangular_factor(s.problem(), s.model.start(), s.free, s.scale, {tau});
  EXPECT_FALSE(load_response(s.problem(), s.model.start(), s.free, s.scale, factor));
}

/// An arm in modified DH with its tool on the last axis, whose joints 1, 4 and 5 give; nothing loads joint 1 where its
/// axis is that of the base.
ErrorModel compliant_arm() {
  RobotDescription description;
  const test::Tables tables = test::six_axes();
  description.joint_types = tables.types;
  description.T_flange_tool.p = {0, 0, 0.15};
  description.bodies.resize(6);
  description.bodies[4].mass = 300;
  description.bodies[4].com = {0, 0, 0.3};
  RowMatrixXd rows = tables.rows;
  rows.row(0).tail(3).setZero();
  rows.bottomRows(5).rightCols(3) = tables.rows.topRows(5).rightCols(3);
  const RobotModel robot = build_mdh(description, rows);
  std::vector<std::shared_ptr<const Effect>> effects;
  for (const char* joint : {"joint1", "joint4", "joint5"})
    effects.push_back(make_effect("joint_compliance", robot, joint, {}));
  return ErrorModel(robot, effects, Eigen::VectorXd::Zero(3));
}

// The base leans, and the coarse fit lets the first axis lean in it by half of that: what then turns that axis would
// show its compliance. The gauge puts the axis upright in the base.
TEST(LoadResponse, WhatNothingLoadsWhereTheGaugeLeadsIsHeld) {
  const ErrorModel model = compliant_arm();
  const int compliance = test::index_of(model, "joint1 compliance");
  Random random(3);
  Samples samples = test::postures(random, 300, 6);
  Eigen::VectorXd truth = test::disturbed(random, model, 5e-4);
  truth[test::index_of(model, "base rx")] += 5e-3;
  truth.tail(3) << 0, 3e-7, 1e-7;
  settle(model, truth, 1, samples);
  const test::Measured measured = test::measure(random, model, samples, truth, test::What::kPositions, {1e-5, 0});
  std::vector<int> all(static_cast<std::size_t>(model.parameter_count()));
  std::iota(all.begin(), all.end(), 0);
  const Identification result = identify({model, samples, measured}, all, Eigen::VectorXd(), {});
  EXPECT_EQ(result.status, Status::kConverged) << result.message;
  EXPECT_EQ(std::count(result.held.begin(), result.held.end(), compliance), 1);
  EXPECT_LT(result.iterations, 60);  // nothing had to be taken back
}

}  // namespace
}  // namespace fastcal
