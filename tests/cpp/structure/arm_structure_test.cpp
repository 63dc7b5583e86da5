// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/arm_structure.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fastcal/math/check.hpp"
#include "fastcal/model/settle.hpp"
#include "support/robots.hpp"
#include "support/structures.hpp"

namespace fastcal::test {
namespace {

RobotModel six_axis_arm(std::shared_ptr<const ArmBending> beams) {
  RobotDescription description;
  description.joint_types.assign(6, JointType::kRevolute);
  description.bodies.resize(6);
  for (Body& body : description.bodies) {
    body.mass = 8;
    body.com = {0.1, -0.05, 0.02};
  }
  description.T_world_base = {rpy_to_rotation({0.3, -0.2, 1.1}), {0.5, -1, 0.2}};
  description.p_flange_payload = {0.02, 0.1, 0.08};
  description.bending = std::move(beams);
  return build_dh(description, six_axes().rows);
}

struct Settled {
  RobotModel robot;
  Samples samples;
  Settled(std::shared_ptr<const ArmBending> beams, const std::vector<double>& q)
      : robot(six_axis_arm(std::move(beams))) {
    samples.q = Eigen::Map<const Eigen::RowVectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
    samples.payload = Eigen::VectorXd::Constant(1, 7);
    const ErrorModel model(robot);
    settle(model, model.start(), 1, samples, SettleOptions{kFrames | kLoads});
  }
};

const std::vector<double> kPosture{0.3, -0.4, 0.2, 0.5, -0.6, 0.1};

TEST(ArmStructure, LoadsAreTheWeightsOfWhatItsNodesCarry) {
  const Settled arm(six_axis_beams(), kPosture);
  const auto& beams = dynamic_cast<const ArmStructure&>(*arm.robot.description().bending);
  const State state = arm.samples.row(0);
  const RowMatrixXd at = beams.positions(state), load = beams.loads(arm.robot.description(), state, at);
  const Eigen::Vector3d gravity = arm.samples.gravity;
  EXPECT_LT((load.row(2).head<3>() - 12 * gravity.transpose()).norm(), 1e-12);
  EXPECT_EQ(load.row(2).tail<3>().norm(), 0);
  // Links 5 and 6 and the payload hang on the wrist: what joint 5 carries, taken about another point.
  const Pose& joint = state.frames[joint_frame(4)];
  const Eigen::Map<const Eigen::Vector3d> F(state.load + 6 * joint_frame(4)), M(state.load + 6 * joint_frame(4) + 3);
  const Eigen::Vector3d force = joint.R * F;
  const Eigen::Vector3d moment = joint.R * M + (joint.p - at.row(3).transpose()).cross(force);
  EXPECT_LT((load.row(3).head<3>().transpose() - force).norm(), 1e-10);
  EXPECT_LT((load.row(3).tail<3>().transpose() - moment).norm(), 1e-10);
}

TEST(ArmStructure, TwistsCarryTheChainWhereTheNodesGo) {
  const Settled arm(six_axis_beams(), kPosture);
  const auto& beams = dynamic_cast<const ArmStructure&>(*arm.robot.description().bending);
  const State state = arm.samples.row(0);
  // Displacements of the same frame, solved beside it.
  BeamFrame frame;
  frame.dimension = 3;
  frame.node_count = 4;
  frame.elements = {tube("", 0, 1, 60).beam, tube("", 1, 2, 40).beam, tube("", 2, 3, 25, 1, 4e4).beam};
  frame.supports = {{0, 63}};
  const RowMatrixXd at = beams.positions(state), load = beams.loads(arm.robot.description(), state, at);
  RowMatrixXd u(4, 6);
  BeamPostures posture;
  posture.count = 1;
  posture.nodes = at.data();
  posture.load = {load.data(), 0};
  posture.gravity = {state.gravity, 0};
  BeamSolver(frame).solve(posture, {}, 1, u.data());

  const double scale[] = {1, 1}, tiny = 1e-4;  // small enough for small displacements
  std::vector<double> B(static_cast<std::size_t>(beams.width()));
  beams.basis(arm.robot.description(), state, scale, B.data());
  Twists xi = Twists::Zero(6, arm.robot.frame_count());
  for (std::size_t f = 0; f < beams.frames().size(); ++f) {
    for (std::size_t g = 0; g < 2; ++g)
      xi.col(beams.frames()[f]) += tiny * Eigen::Map<const Vector6d>(B.data() + 6 * (2 * f + g));
  }
  std::vector<Pose> bent;
  forward(arm.robot.chain(), state.q, &xi, bent);
  const int frames[] = {link_frame(0), link_frame(1), link_frame(3)};
  for (int k = 0; k < 3; ++k) {
    const Pose& before = state.frames[frames[k]];
    const Pose& after = bent[static_cast<std::size_t>(frames[k])];
    EXPECT_LT((after.p - before.p - tiny * u.row(k + 1).head<3>().transpose()).norm(), 1e-4 * tiny * u.norm()) << k;
    const Eigen::Matrix3d turn = after.R * before.R.transpose();
    const Eigen::Vector3d angle(turn(2, 1), turn(0, 2), turn(1, 0));
    EXPECT_LT((angle - tiny * u.row(k + 1).tail<3>().transpose()).norm(), 1e-4 * tiny * u.norm()) << k;
  }
}

TEST(ArmStructure, SaysWhichNodeOfWhichPostureIsFree) {
  StructureDescription beams;
  beams.nodes = {node_at("foot", kBaseFrame, true), node_at("elbow", link_frame(1))};
  beams.elements = {tube("arm", 0, 1, 60)};
  beams.elements[0].start_hinge = 6;
  beams.groups = {"all"};
  const Settled arm(std::make_shared<ArmStructure>(beams), kPosture);
  std::vector<double> B(6);
  const double scale = 1;
  try {
    arm.robot.description().bending->basis(arm.robot.description(), arm.samples.row(0), &scale, B.data());
    FAIL();
  } catch (const InvalidInput& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("q = (0.3, -0.4, 0.2, 0.5, -0.6, 0.1)"), std::string::npos) << text;
    EXPECT_NE(text.find("node elbow is free"), std::string::npos) << text;
  }
}

TEST(ArmStructure, RefusesWhatDoesNothingOrTwice) {
  StructureDescription beams;
  beams.nodes = {node_at("foot", kBaseFrame, true), node_at("elbow", link_frame(1))};
  beams.elements = {tube("arm", 0, 1, 60)};
  beams.groups = {"all"};
  beams.nodes[1].moves = -1;
  EXPECT_THROW(ArmStructure{beams}, InvalidInput);
  beams.nodes[0].moves = beams.nodes[1].moves = link_frame(1);
  EXPECT_THROW(ArmStructure{beams}, InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
