// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Frames that can't be solved say which node is free, and in which direction.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "fastcal/math/check.hpp"
#include "structure/solve.hpp"

namespace fastcal::test {
namespace {

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "nothing was thrown";
}

#define EXPECT_SAYS(call, words)                              \
  {                                                           \
    const std::string said = message_of([&] { (void)call; }); \
    EXPECT_NE(said.find(words), std::string::npos) << said;   \
  }

/// Four bars hinged at all corners, two of them on the ground: a parallelogram that can lean over.
struct FourBar {
  BeamFrame frame{2, 4, {beam(0, 1), beam(1, 2), beam(3, 2)}, {}, {fixed(0, 2), fixed(3, 2)}};
  RowMatrixXd nodes = RowMatrixXd(4, 2);
  FourBar() {
    nodes << 0, 0, 0, 1.5, 2, 1.5, 2, 0;
    for (int e = 0; e < 3; ++e) {
      for (int end = 0; end < 2; ++end) frame.hinges.push_back({e, end, 4});
    }
  }
};

TEST(Mechanism, AFourBarLinkageLeansOver) {
  const FourBar bars;
  EXPECT_SAYS(solve(bars.frame, bars.nodes, {}), "posture 0: node 1 is free to move along x");
}

TEST(Mechanism, OneWeldedCornerStopsIt) {
  FourBar bars;
  bars.frame.hinges.erase(bars.frame.hinges.begin());
  const RowMatrixXd u = solve(bars.frame, bars.nodes, {{}, Eigen::Vector2d(0, -9.8), {}, {}});
  EXPECT_TRUE(u.allFinite());
}

TEST(Mechanism, AnElementHingedToARotationThatNothingHoldsSwings) {
  RowMatrixXd nodes(3, 2);
  nodes << 0, 0, 1, 0, 2, 1;
  const BeamFrame frame{2, 3, {beam(0, 1), beam(1, 2)}, {{1, 0, 4}}, {fixed(0, 2)}};
  EXPECT_SAYS(solve(frame, nodes, {}), "node 2 is free to move along (0.71, -0.71)");
}

TEST(Mechanism, ASpaceFrameHeldAtTwoHingesTurnsAboutTheLineBetweenThem) {
  RowMatrixXd nodes(3, 3);
  nodes << 0, 0, 0, 1, 0.4, 0, 2, 0, 0;
  const BeamFrame frame{3, 3, {beam(0, 1), beam(1, 2)}, {{0, 0, 7}, {1, 1, 7}}, {fixed(0, 3), fixed(2, 3)}};
  EXPECT_SAYS(solve(frame, nodes, {}), "node 1 is free to move along z");
}

TEST(Mechanism, ASupportThatLeavesADirectionIsTold) {
  RowMatrixXd nodes(2, 2);
  nodes << 0, 0, 1, 0;
  const BeamFrame frame{2, 2, {beam(0, 1)}, {}, {{0, 6}}};
  EXPECT_SAYS(solve(frame, nodes, {}), "is free to move along x");
}

TEST(Mechanism, ThePostureThatFailsIsNamed) {
  const BeamFrame frame{2, 2, {beam(0, 1)}, {}, {fixed(0, 2)}};
  RowMatrixXd nodes(12, 2);
  for (int i = 0; i < 6; ++i) nodes.middleRows(2 * i, 2) << 0, 0, i == 4 ? 0 : 1, 0;
  const Eigen::Vector2d gravity(0, -9.8);
  BeamPostures postures;
  postures.count = 6;
  postures.nodes = nodes.data();
  postures.gravity = {gravity.data(), 0};
  RowMatrixXd u(12, 3);
  EXPECT_SAYS(BeamSolver(frame).solve(postures, {}, 1, u.data()),
              "posture 4: element 0 has no length, nodes 0 and 1 coincide");
}

TEST(Mechanism, AMomentOnALooseRotationIsRefused) {
  RowMatrixXd nodes(3, 2), load = RowMatrixXd::Zero(3, 3);
  nodes << -1, 0, 1, 0, 0, 1;
  BeamFrame frame{2, 3, {beam(0, 2), beam(1, 2)}, {{0, 1, 4}, {1, 1, 4}}, {fixed(0, 2), fixed(1, 2)}};
  EXPECT_EQ(solve(frame, nodes, {{}, Eigen::Vector2d(3, -9.8), {}, {}})(2, 2), 0.0);
  load(2, 2) = 1;
  EXPECT_SAYS(solve(frame, nodes, {load, {}, {}, {}}), "a moment acts on node 2 about z");
}

TEST(Mechanism, InSpaceARotationIsLooseAboutTheAxisThatNoElementHolds) {
  RowMatrixXd nodes(3, 3), load = RowMatrixXd::Zero(3, 6), up(2, 3);
  nodes << -1, 0, 0, 1, 0, 0, 0, 1, 0;
  up << 0, 0, 1, 0, 0, 1;
  const BeamFrame frame{3, 3, {beam(0, 2), beam(1, 2)}, {{0, 1, 4}, {1, 1, 4}}, {fixed(0, 3), fixed(1, 3)}};
  load.row(2) << 100, 200, -300, 20, -10, 0;
  const RowMatrixXd u = solve(frame, nodes, {load, {}, up, {}});
  EXPECT_NEAR(u(2, 5), 0, 1e-18);
  EXPECT_GT(std::abs(u(2, 3)), 1e-8);
  load(2, 5) = 0.5;
  EXPECT_SAYS(solve(frame, nodes, {load, {}, up, {}}), "a moment acts on node 2 about z");
}

TEST(Mechanism, AnUpAlongItsElementIsTold) {
  RowMatrixXd nodes(2, 3);
  nodes << 0, 0, 0, 0, 0, 1;
  BeamFrame frame{3, 2, {beam(0, 1)}, {}, {fixed(0, 3)}};
  EXPECT_SAYS(solve(frame, nodes, {}), "the y axis of element 0 is not known: its `up` direction z runs along it");
  frame.elements[0].inertia_y = frame.elements[0].inertia_z;
  EXPECT_TRUE(solve(frame, nodes, {}).isZero(0));
}

TEST(Mechanism, WhatIsNoFrameIsRefused) {
  const BeamFrame good{2, 2, {beam(0, 1)}, {}, {fixed(0, 2)}};
  const auto says = [&](const std::function<void(BeamFrame&)>& spoil) {
    BeamFrame frame = good;
    spoil(frame);
    return message_of([&] { check(frame); });
  };
  EXPECT_EQ(says([](BeamFrame& f) { f.elements[0].end = 5; }), "element 0 names node 5, but the nodes are 0 to 1");
  EXPECT_EQ(says([](BeamFrame& f) { f.elements[0].end = 0; }), "element 0 begins and ends at node 0");
  EXPECT_EQ(says([](BeamFrame& f) { f.elements[0].area = 0; }), "area of element 0 must be a positive number, got 0");
  EXPECT_EQ(says([](BeamFrame& f) { f.supports.clear(); }), "a frame needs at least one support");
  EXPECT_EQ(says([](BeamFrame& f) { f.node_count = 3; }), "node 2 is free: no element ends there");
  EXPECT_EQ(says([](BeamFrame& f) { f.hinges = {{0, 2, 4}}; }), "a hinge of element 0 must be at end 0 or 1, got 2");
  EXPECT_EQ(says([](BeamFrame& f) { f.hinges = {{0, 0, 1}}; }), "a hinge of element 0 of a plane frame turns about z");
  EXPECT_EQ(says([](BeamFrame& f) {
              f.dimension = 3;
              f.hinges = {{0, 0, 1}, {0, 1, 3}};
            }),
            "element 0 is free to spin about its own axis: both of its ends are released about x");
}

}  // namespace
}  // namespace fastcal::test
