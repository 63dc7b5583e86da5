// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One beam is the cantilever of link_bending_test.cpp: 1 m, 10 kg spread evenly, EI = 1e5 N m^2, 20 kg whose centre
// lies 0.1 m beyond its end: sag (P/3 + M/2 + w/8)/EI, slope (P/2 + M + w/6)/EI.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"
#include "fastcal/math/check.hpp"
#include "support/robots.hpp"
#include "support/structures.hpp"

namespace fastcal::test {
namespace {

constexpr double kP = 20 * kG, kM = 2 * kG, kW = 10 * kG, kEI = 1e5;
constexpr double kSag = (kP / 3 + kM / 2 + kW / 8) / kEI;
constexpr double kSlope = (kP / 2 + kM + kW / 6) / kEI;

/// The level arm as one beam, or as several of one length; its nodes stand along joint_1's x, the last one at link_1.
RobotModel beam_arm(int count = 1, bool grouped = false, double beyond = 0.1) {
  RobotDescription description = level_description();
  description.p_flange_payload = {beyond, 0, 0};
  StructureDescription beams;
  for (int k = 0; k <= count; ++k) {
    beams.nodes.push_back(node_at("node" + std::to_string(k), k == count ? link_frame(0) : joint_frame(0), k == 0));
    if (k < count) beams.nodes.back().moves = -1;
    if (k < count) beams.nodes.back().position = {static_cast<double>(k) / count, 0, 0};
    if (k > 0) beams.elements.push_back(tube("beam" + std::to_string(k), k - 1, k, 10.0 / count, grouped ? k - 1 : 0));
    if (k > 0 && (grouped || k == 1)) beams.groups.push_back("g" + std::to_string(k));
  }
  beams.nodes.back().carries_payload = true;
  description.bending = std::make_shared<ArmStructure>(beams);
  return level_arm(description);
}

Vector6d sag(double scale) { return (Vector6d() << 0, -scale * kSag, 0, 0, 0, -scale * kSlope).finished(); }

TEST(BeamGravity, OneBeamIsTheCantilever) {
  for (const int count : {1, 3}) {
    const ErrorModel model = with(beam_arm(count), {{"beam_gravity", "structure", {0.7}, {}}}).with_equilibrium(false);
    const Twists xi = twists(model, posture({0}, 20));
    EXPECT_TRUE(xi.col(link_frame(0)).isApprox(sag(0.7), 1e-11)) << xi.col(link_frame(0)).transpose();
    EXPECT_EQ(xi.norm(), xi.col(link_frame(0)).norm());
  }
}

TEST(BeamGravity, AnUprightBeamIsOnlyPressed) {
  const ErrorModel model = with(beam_arm(), {{"beam_gravity", "structure", {1}, {}}}).with_equilibrium(false);
  const Twists xi = twists(model, posture({kHalfPi}, 20));
  const double pressed = (20 + 5) * kG / (2e11 * 3e-3);
  EXPECT_NEAR(xi(0, link_frame(0)), -pressed, 1e-6 * pressed);
  // The payload's centre lies on the beam's line.
  EXPECT_LT(xi.col(link_frame(0)).tail<5>().norm(), 1e-12);
}

TEST(BeamGravity, GroupsAddUpAndEachIsItsOwnSpring) {
  // A cantilever of two halves: the outer one bends under what is beyond it, the inner one carries it along.
  const auto by_group = [](double inner, double outer) {
    const Options options{{"by", std::string("group")}};
    return twists(with(beam_arm(2, true), {{"beam_gravity", "structure", {inner, outer}, options}})
                      .with_equilibrium(false),
                  posture({0}, 20))
        .col(link_frame(0))
        .eval();
  };
  EXPECT_TRUE(by_group(1, 1).isApprox(sag(1), 1e-11));
  EXPECT_TRUE(by_group(0.4, 0.4).isApprox(sag(0.4), 1e-11));
  EXPECT_TRUE((by_group(1, 0) + by_group(0, 1)).isApprox(sag(1), 1e-9));
  // The outer half, 0.5 m, with 5 kg of its own and the payload at its end.
  const double L = 0.5, w = kW;
  const double u = (kP * L * L * L / 3 + kM * L * L / 2 + w * L * L * L * L / 8) / kEI;
  EXPECT_NEAR(by_group(0, 1)[1], -u, 1e-9 * u);
}

TEST(BeamGravity, SinksFurtherWhereItsOwnSagTurnsTheLoad) {
  // At 45 degrees the sag turns the beam towards level: the load across it grows.
  const ErrorModel model = with(beam_arm(1, false, 0), {{"beam_gravity", "structure", {5}, {}}});
  const double first = twists(model.with_equilibrium(false), posture({kHalfPi / 2}, 20))(1, link_frame(0));
  const double settled = twists(model, posture({kHalfPi / 2}, 20))(1, link_frame(0));
  const double turn = -first;  // of the chord of 1 m
  EXPECT_NEAR(settled / first, 1 + turn, 2 * turn * turn);
}

TEST(BeamGravity, ScaleAndGroupsAreOneModel) {
  RobotDescription description;
  description.joint_types.assign(6, JointType::kRevolute);
  description.bodies.resize(6);
  for (Body& body : description.bodies) body.mass = 8;
  description.bending = six_axis_beams();
  const RobotModel robot = build_dh(description, six_axes().rows);
  const Samples samples = posture({0.3, -0.4, 0.2, 0.5, -0.6, 0.1}, 9);
  const Pose one = tool(with(robot, {{"beam_gravity", "structure", {0.8}, {}}}), samples);
  const Options options{{"by", std::string("group")}};
  const Pose two = tool(with(robot, {{"beam_gravity", "structure", {0.8, 0.8}, options}}), samples);
  EXPECT_LT((one.p - two.p).norm(), 1e-12);
  EXPECT_LT((one.R - two.R).norm(), 1e-12);
}

TEST(BeamGravity, NeedsAStructureAndKnowsTwoWays) {
  EXPECT_THROW(make_effect("beam_gravity", level_arm(), "structure", {}), InvalidInput);
  EXPECT_TRUE(effect_entry("beam_gravity").owners(level_arm()).empty());
  EXPECT_THROW(make_effect("beam_gravity", beam_arm(), "structure", {{"by", std::string("link")}}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
