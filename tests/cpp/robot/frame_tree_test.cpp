// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Robots joined to a tree: its order, the poses of its frames against those of the robots alone, what weighs on whom,
// and the sentences that refuse a tree that cannot be.
#include "fastcal/robot/frame_tree.hpp"

#include <gtest/gtest.h>

#include "fastcal/math/check.hpp"
#include "fastcal/robot/kinematics.hpp"
#include "fastcal/robot/statics.hpp"
#include "support/trees.hpp"

namespace fastcal {
namespace {

using test::Random;

std::string refusal(const std::vector<Member>& members) {
  try {
    join(members);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "nothing was refused";
}

TEST(FrameTree, AnArmIsATreeOfOneBranch) {
  const RobotModel arm = test::build("dh", test::six_axes());
  EXPECT_TRUE(arm.tree().is_serial());
  EXPECT_EQ(arm.frame_count(), 14);
  EXPECT_EQ(arm.view().target, 13);
  EXPECT_EQ(arm.tree().frame("joint3"), joint_frame(2));
  for (int f = 0; f < 14; ++f) {
    EXPECT_EQ(arm.tree().parent(f), f - 1);
    EXPECT_EQ(arm.tree().end(f), 14);
    EXPECT_EQ(arm.tree().joint(f), f % 2 == 1 && f < 13 ? f / 2 : -1);
  }
}

TEST(FrameTree, WhatAFrameCarriesIsARangeBehindIt) {
  Random random(1);
  for (int trial = 0; trial < test::repeat(50); ++trial) {
    const RobotModel robot = join(test::random_members(random, 5));
    const FrameTree& tree = robot.tree();
    int joints = 0;
    for (int f = 0; f < tree.frame_count(); ++f) {
      ASSERT_LT(tree.parent(f), f);
      for (int other = 0; other < tree.frame_count(); ++other) {
        int up = other;
        while (up > f) up = tree.parent(up);
        ASSERT_EQ(tree.carries(f, other), up == f) << tree.name(f) << " and " << tree.name(other);
      }
      if (tree.joint(f) < 0) continue;
      ASSERT_EQ(tree.joint(f), joints++);
      ASSERT_EQ(tree.frame_of_joint(tree.joint(f)), f);
    }
    ASSERT_EQ(joints, robot.joint_count());
  }
}

TEST(FrameTree, FramesAreThoseOfTheArmsOneOnTheOther) {
  Random random(2);
  for (int trial = 0; trial < test::repeat(50); ++trial) {
    const std::vector<Member> members = test::random_members(random, 5);
    const RobotModel robot = join(members);
    const Eigen::VectorXd q = random.values(robot.joint_count(), 2);
    std::vector<Pose> all, own;
    forward(robot.chain(), q.data(), nullptr, all);
    for (const Branch& branch : robot.tree().branches()) {
      const auto of =
          std::find_if(members.begin(), members.end(), [&](const Member& m) { return m.name == branch.name; });
      const Pose on = branch.parent == kWorldFrame ? Pose() : all[static_cast<std::size_t>(branch.parent)];
      if (of->robot == nullptr)
        own = {of->T_on_frame};
      else
        forward(of->robot->chain(), q.data() + branch.first_joint, nullptr, own);
      ASSERT_EQ(static_cast<int>(own.size()), branch.frame_count);
      for (std::size_t k = 0; k < own.size(); ++k) {
        const Pose wanted = on * own[k];
        const Pose& found = all[static_cast<std::size_t>(branch.first_frame) + k];
        ASSERT_LT((found.p - wanted.p).norm() + (found.R - wanted.R).norm(), 1e-12);
      }
    }
    const View view{robot.tree().frame("target"), robot.tree().frame("arm0.joint1")};
    const Pose wanted =
        all[static_cast<std::size_t>(view.sensor)].inverse() * all[static_cast<std::size_t>(view.target)];
    ASSERT_LT((seen(view, all).p - wanted.p).norm(), 1e-13);
  }
}

/// A joint's load is the slope of the potential energy by its position, of all that it carries.
TEST(FrameTree, LoadsAddUpToTheParent) {
  Random random(3);
  for (int trial = 0; trial < test::repeat(20); ++trial) {
    const RobotModel robot = join(test::random_members(random, 5));
    const RobotDescription& description = robot.description();
    const Chain chain = robot.chain();
    std::vector<Pose> frames;
    Samples samples;
    samples.q = random.values(robot.joint_count(), 2).transpose();
    samples.payload = RowMatrixXd::NullaryExpr(1, 5, [&] { return random.chance(0.5) ? 0 : random.uniform(1, 20); });
    const auto payload_energy = [&](const Eigen::VectorXd& q) {  // less the work of gravity, m g . p
      forward(chain, q.data(), nullptr, frames);
      double sum = 0;
      for (const Branch& branch : robot.tree().branches()) {
        if (branch.arm < 0) continue;
        const Pose& flange = frames[static_cast<std::size_t>(branch.end() - 2)];
        sum += samples.payload(0, branch.arm) *
               description.gravity.dot(flange * description.hand(branch.arm).p_flange_payload);
      }
      return sum;
    };
    const auto energy = [&](const Eigen::VectorXd& q) {
      double sum = payload_energy(q);
      for (int j = 0; j < robot.joint_count(); ++j) {
        const auto k = static_cast<std::size_t>(j);
        const Pose& T = frames[static_cast<std::size_t>(robot.tree().frame_of_joint(j))];
        sum += description.bodies[k].mass *
               description.gravity.dot(T * (chain.body_frames[k] * description.bodies[k].com));
      }
      return sum;
    };
    const Eigen::VectorXd q = samples.q.table().transpose();
    const State state = samples.row(0);
    forward(chain, q.data(), nullptr, frames);
    std::vector<double> load(6 * frames.size()), payload(load.size());
    frame_loads(description, chain, frames, state, description.gravity, load.data(), payload.data());
    constexpr double h = 1e-3;
    for (int j = 0; j < robot.joint_count(); ++j) {
      const Eigen::VectorXd d = h * Eigen::VectorXd::Unit(q.size(), j);
      const auto slope = [&](const auto& of) {
        return (8 * (of(q + d) - of(q - d)) - (of(q + 2 * d) - of(q - 2 * d))) / (12 * h);
      };
      const double wanted = slope(energy), hung = slope(payload_energy);
      const bool turns = description.joint_types[static_cast<std::size_t>(j)] == JointType::kRevolute;
      const int frame = robot.tree().frame_of_joint(j);
      const auto at = static_cast<std::size_t>(6 * frame + (turns ? 5 : 2));
      ASSERT_NEAR(load[at], wanted, 1e-7 * (1 + std::abs(wanted)));
      ASSERT_NEAR(payload[at], hung, 1e-7 * (1 + std::abs(hung)));
    }
  }
}

TEST(FrameTree, WhatCannotBeIsRefusedInOneSentence) {
  Random random(4);
  const auto arm = std::make_shared<const RobotModel>(test::build("dh", test::six_axes()));
  EXPECT_EQ(refusal({{"a", arm, {}, "b.link6"}, {"b", arm, {}, "a.link6"}}),
            "'a' stands on 'b.link6', which in the end stands on 'a' itself");
  EXPECT_EQ(refusal({{"a", arm, {}, "world"}, {"p", nullptr, {}, "a.link9"}}),
            "'p' stands on 'a.link9', and there is no such frame");
  EXPECT_EQ(refusal({{"a", arm, {}, "world"}, {"a", nullptr, {}, "world"}, {"a", nullptr, {}, "world"}}),
            "two frames are named 'a'");
  EXPECT_EQ(refusal({{"p", nullptr, {}, "world"}}), "a tree of frames needs at least one robot, got none");
  const RobotModel robot = join({{"a", arm, {}, "world"}, {"p", nullptr, {}, "a.link6"}});
  EXPECT_THROW(static_cast<void>(robot.tree().view("p:camera")), InvalidInput);
  EXPECT_THROW(static_cast<void>(robot.with_base_and_tool({}, {})), InvalidInput);
  EXPECT_EQ(robot.tree().view("p:world").sensor, kWorldFrame);
}

}  // namespace
}  // namespace fastcal
