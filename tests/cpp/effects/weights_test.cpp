// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Masses and centres that differ from the robot file: the arm stands as one whose file gives the true ones, under every
// compliance.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"
#include "support/random.hpp"

namespace fastcal::test {
namespace {

RobotDescription six_bodies() {
  RobotDescription description;
  Random random(5);
  description.joint_types.assign(6, JointType::kRevolute);
  description.joint_types[2] = JointType::kPrismatic;
  description.bodies.resize(6);
  for (Body& body : description.bodies) {
    body.mass = random.uniform(5, 60);
    body.com = random.vector(0.3);
  }
  description.p_flange_payload = {0.1, 0.02, 0.2};
  return description;
}

RobotModel build(const RobotDescription& description) {
  Random random(6);
  RowMatrixXd rows(6, 5);
  for (Eigen::Index i = 0; i < rows.size(); ++i) rows.data()[i] = random.uniform(-0.8, 0.8);
  return build_dh(description, rows);
}

/// Something of every kind gives way.
std::vector<Cause> soft() {
  return {{"joint_compliance", "joint1", {2e-6}, {}}, {"joint_compliance_nonlinear", "joint2", {4e-6, 1e-6, 100}, {}},
          {"joint_compliance", "joint3", {3e-7}, {}}, {"link_bending", "link2", {1e-6}, {}},
          {"link_torsion", "link4", {1e-6}, {}},      {"bearing_tilt", "joint1", {1e-6}, {}}};
}

void expect_same_arm(const RobotDescription& truth, const std::vector<Cause>& weights, double payload,
                     double true_payload) {
  std::vector<Cause> causes = soft();
  causes.insert(causes.end(), weights.begin(), weights.end());
  const std::vector<double> q{0.3, -0.7, 0.2, 1.1, -0.4, 2.0};
  const Pose got = tool(with(build(six_bodies()), causes), posture(q, payload));
  const Pose expected = tool(with(build(truth), soft()), posture(q, true_payload));
  const Pose nominal = tool(with(build(six_bodies()), soft()), posture(q, payload));
  EXPECT_GT((nominal.p - expected.p).norm(), 1e-6);
  EXPECT_LT((got.p - expected.p).norm(), 1e-13);
  EXPECT_LT((got.R - expected.R).norm(), 1e-13);
}

TEST(Weights, ALinkIsHeavier) {
  RobotDescription truth = six_bodies();
  truth.bodies[3].mass += 4;
  expect_same_arm(truth, {{"link_mass", "link4", {4}, {}}}, 12, 12);
}

TEST(Weights, ALinksCentreIsElsewhere) {
  RobotDescription truth = six_bodies();
  const Eigen::Vector3d shift(0.03, -0.02, 0.05);
  truth.bodies[4].com += shift;
  const Eigen::Vector3d moment = truth.bodies[4].mass * shift;
  expect_same_arm(truth, {{"link_com", "link5", {moment.x(), moment.y(), moment.z()}, {}}}, 0, 0);
}

TEST(Weights, ThePayloadIsHeavierAndElsewhere) {
  RobotDescription truth = six_bodies();
  truth.p_flange_payload += Eigen::Vector3d(0.02, 0.01, -0.03);
  expect_same_arm(truth, {{"payload_mass", "payload", {3}, {}}, {"payload_com", "payload", {0.02, 0.01, -0.03}, {}}},
                  20, 23);
}

TEST(Weights, RowsWithoutAPayloadHaveNone) {
  const ErrorModel model =
      with(level_arm(), {{"joint_compliance", "joint1", {1e-5}, {}}, {"payload_mass", "payload", {3}, {}}});
  const ErrorModel without = with(level_arm(), {{"joint_compliance", "joint1", {1e-5}, {}}});
  EXPECT_LT((tool(model, posture({0.2})).p - tool(without, posture({0.2})).p).norm(), 1e-15);
}

TEST(Weights, AMassThatTheFileDoesNotGiveHangsHalfWayAlongTheLink) {
  RobotDescription description = level_description();
  description.bodies[0] = Body();
  const ErrorModel model =
      with(level_arm(description), {{"joint_compliance", "joint1", {1e-5}, {}}, {"link_mass", "link1", {10}, {}}});
  EXPECT_NEAR(twists(model.with_equilibrium(false), posture({0}))(5, joint_frame(0)), -4.903325e-4, 1e-16);
}

TEST(Weights, TheSolversDerivativeIsThatOfTheSettledArm) {
  // At equilibrium the deflection feeds back on the loads, by less than a per cent here; J leaves that to the outer
  // iterations.
  const auto at = [](double extra) {
    return with(level_arm(), {{"joint_compliance", "joint1", {1e-5}, {}}, {"link_mass", "link1", {extra}, {}}});
  };
  const ErrorModel model = at(2);
  RowMatrixXd rows(3, model.parameter_count());
  parameter_jacobian(model, posture({0.2}), model.start(), 3, 1, rows.data());
  const Eigen::Vector3d numeric = (tool(at(2.01), posture({0.2})).p - tool(at(1.99), posture({0.2})).p) / 0.02;
  EXPECT_LT((rows.rightCols(1) - numeric).norm(), 1e-3 * numeric.norm());
}

}  // namespace
}  // namespace fastcal::test
