// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Gravity torques against KDL's recursive Newton-Euler, whose torques hold the arm: they are minus our loads. Random
// arms of every kind, revolute and prismatic joints, in random postures.
#include "fastcal/robot/statics.hpp"

#include <gtest/gtest.h>

#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>

#include "support/robots.hpp"

namespace fastcal::test {
namespace {

KDL::Frame to_kdl(const Pose& T) {
  const Eigen::Matrix3d& R = T.R;
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          KDL::Vector(T.p.x(), T.p.y(), T.p.z())};
}

/// The chain with its bodies, the payload as one more at the flange.
KDL::Chain to_kdl(const Chain& chain, const RobotDescription& description, double payload) {
  const auto fixed = [&](int frame, const KDL::RigidBodyInertia& inertia = KDL::RigidBodyInertia::Zero()) {
    return KDL::Segment(KDL::Joint(KDL::Joint::None), to_kdl(chain.constants[static_cast<std::size_t>(frame)]),
                        inertia);
  };
  const auto weight = [](double mass, const Eigen::Vector3d& at) {
    return KDL::RigidBodyInertia(mass, KDL::Vector(at.x(), at.y(), at.z()), KDL::RotationalInertia::Zero());
  };
  KDL::Chain out;
  out.addSegment(fixed(kBaseFrame));
  const int n = chain.joint_count();
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Body& body = description.bodies[k];
    const bool revolute = description.joint_types[k] == JointType::kRevolute;
    out.addSegment(fixed(joint_frame(i)));
    out.addSegment(KDL::Segment(KDL::Joint(revolute ? KDL::Joint::RotZ : KDL::Joint::TransZ), KDL::Frame::Identity(),
                                weight(body.mass, chain.body_frames[k] * body.com)));
    out.addSegment(fixed(link_frame(i), weight(i == n - 1 ? payload : 0, description.p_flange_payload)));
  }
  return out;
}

class Statics : public testing::TestWithParam<const char*> {};

TEST_P(Statics, LoadsAreMinusTheTorquesOfKdl) {
  Random random(17);
  for (int arm = 0; arm < repeat(100); ++arm) {
    const RobotModel robot = build(GetParam(), random_tables(random, random.whole(1, 8)));
    RobotDescription description = robot.description();
    for (Body& body : description.bodies) {
      body.mass = random.uniform(0, 300);
      body.com = random.vector(0.5);
    }
    description.p_flange_payload = random.vector(0.4);
    description.gravity = random.vector(10);
    description.gravity_in_world = random.chance(0.5);
    const Chain chain = robot.chain();
    const int n = chain.joint_count();
    const Eigen::VectorXd q = random.values(n, kPi);
    State state;
    state.q = q.data();
    state.payload = random.uniform(0, 200);
    std::vector<Pose> frames;
    forward(chain, q.data(), nullptr, frames);
    const Eigen::Vector3d gravity = gravity_in_world(description, chain.constants[kBaseFrame]);
    Eigen::VectorXd load(6 * chain.frame_count()), payload_load(6 * chain.frame_count());
    frame_loads(description, chain, frames, state, gravity, load.data(), payload_load.data());

    const KDL::Chain same = to_kdl(chain, description, state.payload);  // the solver only refers to it
    KDL::ChainDynParam dynamics(same, KDL::Vector(gravity.x(), gravity.y(), gravity.z()));
    KDL::JntArray positions(static_cast<unsigned>(n)), torques(static_cast<unsigned>(n));
    for (int i = 0; i < n; ++i) positions(static_cast<unsigned>(i)) = q[i];
    ASSERT_EQ(dynamics.JntToGravity(positions, torques), 0);
    for (int i = 0; i < n; ++i) {
      const double got = state.joint_load(load.data(), i, description.joint_types[static_cast<std::size_t>(i)]);
      EXPECT_NEAR(got, -torques(static_cast<unsigned>(i)), 1e-9) << "arm " << arm << " joint " << i + 1;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Statics, testing::ValuesIn(kKinds4),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace fastcal::test
