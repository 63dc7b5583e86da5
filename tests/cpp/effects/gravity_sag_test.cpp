// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An arm of two level links of 1 m in a vertical plane: evenly spread mass has the moments 1.5 m^2 beyond joint 1 and
// 0.5 m^2 beyond joint 2 per kg/m, hence dq_1 = -even (0.75 cos q_1 + 0.25 cos(q_1 + q_2)).
#include <gtest/gtest.h>

#include <random>

#include "effects/loaded.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

RobotModel upright_plane() {
  RobotDescription description;
  description.joint_types.assign(2, JointType::kRevolute);
  description.T_world_base.R = Eigen::AngleAxisd(kHalfPi, Eigen::Vector3d::UnitX()).toRotationMatrix();
  description.gravity_in_world = true;
  RowMatrixXd rows = RowMatrixXd::Zero(2, 5);
  rows.col(2).setOnes();
  return build_dh(description, rows);
}

double turn(const ErrorModel& model, const std::vector<double>& q, int joint = 0) {
  return twists(model.with_equilibrium(false), posture(q))(5, joint_frame(joint));
}

TEST(GravitySag, OfEvenLinksIsWorkedOutByHand) {
  const Options even{{"moments", std::string("even")}};
  const ErrorModel first = with(upright_plane(), {{"gravity_sag", "joint1", {1e-3}, even}});
  const ErrorModel second = with(upright_plane(), {{"gravity_sag", "joint2", {1e-3}, even}});
  for (const auto& q : {std::vector<double>{0, 0}, {0.3, -1.1}, {2.0, 0.7}}) {
    EXPECT_NEAR(turn(first, q), -1e-3 * (0.75 * std::cos(q[0]) + 0.25 * std::cos(q[0] + q[1])), 1e-17);
    EXPECT_NEAR(turn(second, q, 1), -1e-3 * std::cos(q[0] + q[1]), 1e-17);
  }
}

/// The torque of any masses is in the span of its columns: those of six random arms leave nothing.
TEST(GravitySag, HoldsEveryDistributionOfMass) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  RobotDescription description;
  description.joint_types.assign(5, JointType::kRevolute);
  description.joint_types[3] = JointType::kPrismatic;
  description.bodies.resize(5);
  description.T_world_base.R = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  const RowMatrixXd rows = RowMatrixXd::NullaryExpr(5, 5, [&] { return any(random); });
  for (Body& body : description.bodies) {
    body.mass = 2 + any(random);
    body.com = Eigen::Vector3d::NullaryExpr([&] { return any(random); });
  }
  const RobotModel weighed = build_dh(description, rows);
  for (int joint = 0; joint < 3; ++joint) {
    const std::string owner = "joint" + std::to_string(joint + 1);
    const auto effect = make_effect("gravity_sag", weighed, owner, {});
    const auto count = static_cast<Eigen::Index>(effect->parameters().size());
    EXPECT_EQ(count, 2 * (4 - joint) + 1);
    const ErrorModel compliant = with(weighed, {{"joint_compliance", owner, {1e-5}, {}}}).with_equilibrium(false);
    Eigen::MatrixXd columns(60, count);
    Eigen::VectorXd torque(60);
    for (int i = 0; i < 60; ++i) {
      std::vector<double> q(5);
      for (double& value : q) value = 3 * any(random);
      torque[i] = turn(compliant, q, joint);
      for (Eigen::Index k = 0; k < count; ++k) {
        std::vector<double> unit(static_cast<std::size_t>(count), 0.0);
        unit[static_cast<std::size_t>(k)] = 1;
        columns(i, k) = turn(with(weighed, {{"gravity_sag", owner, unit, {}}}), q, joint);
      }
    }
    const Eigen::VectorXd left = torque - columns * columns.colPivHouseholderQr().solve(torque);
    EXPECT_LT(left.norm(), 1e-12 * torque.norm() + 1e-16) << owner;  // joint 1 is upright: no load at all
  }
}

TEST(GravitySag, TheShapesHaveThePenaltyAndTheEvenLinksHaveNone) {
  const auto effect = make_effect("gravity_sag", upright_plane(), "joint1", {});
  EXPECT_EQ(effect->penalty(), (std::vector<double>{0, 1, 1, 1}));
  EXPECT_THROW(make_effect("gravity_sag", upright_plane(), "joint1", {{"moments", std::string("odd")}}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
