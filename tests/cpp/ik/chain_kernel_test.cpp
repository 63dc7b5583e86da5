// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "fastcal/ik/chain_lanes.hpp"
#include "fastcal/ik/chain_solver.hpp"
#include "fastcal/ik/pose_search.hpp"
#include "support/random.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

TEST(ChainLanes, SineAndCosineAreThoseOfTheLibrary) {
  using Lane = ik::Vectors<4>::Lane;
  for (int i = -20000; i < 20000; ++i) {
    const double x = 1e-3 * i + 1e-7 * i * i;
    Lane s, c;
    ik::sine_cosine<4>(Lane{x, -x, 3 * x, x + 1e-9}, s, c);
    EXPECT_NEAR(s[0], std::sin(x), 4e-16);
    EXPECT_NEAR(c[0], std::cos(x), 4e-16);
    EXPECT_EQ(s[1], -s[0]);
    EXPECT_EQ(c[1], c[0]);
    EXPECT_NEAR(s[2], std::sin(3 * x), 4e-16);
    EXPECT_NEAR(c[3], std::cos(x + 1e-9), 4e-16);
  }
}

/// A solver for random chains without limits, in a frame and with a tool of their own.
struct Arm {
  Chain chain;
  JointLimits limits;
  ChainSettings settings;

  Arm(test::Random& random, int joints) : chain(test::build("dh", test::random_tables(random, joints)).chain()) {
    limits.resize(joints, 2);
    limits.col(0).setConstant(-4);
    limits.col(1).setConstant(4);
    settings.reach = joints;
  }
  ChainSolver solver() const { return {chain, limits, settings}; }
  Pose tool(const JointVector& q) const {
    std::vector<Pose> frames;
    forward(chain, q.data(), nullptr, frames);
    return frames.back();
  }
};

TEST(ChainSolver, StandsWhereForwardKinematicsSaysOnChainsOfAnyKind) {
  test::Random random(1);
  for (const int joints : {3, 6, 6, 7, 8}) {
    const Arm arm(random, joints);
    std::vector<Eigen::Index> rows;
    std::vector<Pose> targets;
    std::vector<JointVector> seeds;
    for (Eigen::Index i = 0; i < 21; ++i) {
      rows.push_back(i);
      targets.push_back(arm.tool(random.values(joints, 2)));
      seeds.push_back(random.values(joints, 2));
    }
    const auto found = arm.solver().solve(rows, targets, seeds, 200);
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_TRUE(found[i].reached) << joints << " joints, row " << i;
      const Vector6d left = pose_error(targets[i], arm.tool(found[i].q));
      EXPECT_LT(left.head<3>().norm(), 1.1e-9);
      EXPECT_LT(left.tail<3>().norm(), 1.1e-9);
      EXPECT_LE(found[i].q.cwiseAbs().maxCoeff(), 4);
    }
  }
}

TEST(ChainSolver, GivesATargetTheSameBitsWhateverStandsBesideIt) {
  test::Random random(2);
  const Arm arm(random, 6);
  std::vector<Eigen::Index> rows;
  std::vector<Pose> targets;
  std::vector<JointVector> seeds;
  for (Eigen::Index i = 0; i < 30; ++i) {
    rows.push_back(i);
    targets.push_back(arm.tool(random.values(6, 2)));
    seeds.push_back(random.values(6, 2));
  }
  const ChainSolver solver = arm.solver();
  const auto together = solver.solve(rows, targets, seeds, 50);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto alone = solver.solve({&rows[i], 1}, {&targets[i], 1}, {&seeds[i], 1}, 50);
    EXPECT_EQ(alone.front().q, together[i].q);
    EXPECT_EQ(alone.front().evaluations, together[i].evaluations);
  }
}

TEST(ChainSolver, BoundsTheLeastSingularValueFromBelow) {
  test::Random random(3);
  const Arm arm(random, 6);
  for (Eigen::Index i = 0; i < 20; ++i) {
    const JointVector q = random.values(6, 2);
    const Pose target = arm.tool(q);
    const ChainSolution found = arm.solver().solve({&i, 1}, {&target, 1}, {&q, 1}, 0).front();
    ASSERT_TRUE(found.reached);
    std::vector<Pose> frames;
    forward(arm.chain, q.data(), nullptr, frames);
    const double least = least_singular_value(arm.chain, joint_jacobian(arm.chain, frames), arm.settings.reach);
    EXPECT_LE(found.least_singular_value, least * (1 + 1e-6));
    EXPECT_GE(found.least_singular_value, least / std::sqrt(6.0) * (1 - 1e-6));
  }
}

TEST(BoundedStep, IsTheLeastSquaresStepThatKeepsTheLimits) {
  test::Random random(4);
  for (int k = 0; k < 50; ++k) {
    const ToolJacobian J = ToolJacobian::NullaryExpr(6, 6, [&] { return random.uniform(-1, 1); });
    const Vector6d e = random.values(6, 0.1);
    JointLimits limits(6, 2);
    limits.col(0).setConstant(-0.05);
    limits.col(1).setConstant(0.05);
    const JointVector q = JointVector::Zero(6);
    const JointVector to = bounded_step(J, e, 1e-12, limits, q);
    EXPECT_LE(to.cwiseAbs().maxCoeff(), 0.05);
    // Of the joints that did not stop, none can do better.
    const Vector6d rest = e - J * to;
    for (Eigen::Index i = 0; i < 6; ++i) {
      if (std::abs(to[i]) < 0.05) {
        EXPECT_NEAR(J.col(i).dot(rest), 0, 1e-8);
      }
    }
  }
}

}  // namespace
}  // namespace fastcal
