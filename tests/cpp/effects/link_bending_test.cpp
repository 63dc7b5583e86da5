// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A cantilever of 1 m, 10 kg spread evenly, EI = 1e5 N m^2, with 20 kg whose centre lies 0.1 m beyond its end:
//   P = 196.133 N, M = 19.6133 N m, w = 98.0665 N/m:  sag (P/3 + M/2 + w/8)/EI = 8.744263e-4 m,  slope (P/2 + M +
//   w/6)/EI.
#include <gtest/gtest.h>

#include <cmath>

#include "effects/loaded.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

constexpr double kP = 20 * kG, kM = 2 * kG, kW = 10 * kG, kEI = 1e5;
constexpr double kSag = (kP / 3 + kM / 2 + kW / 8) / kEI;
constexpr double kSlope = (kP / 2 + kM + kW / 6) / kEI;

TEST(LinkBending, SagsAndSlopesAtTheFarEnd) {
  RobotDescription description = level_description();
  description.p_flange_payload = {0.1, 0, 0};
  const ErrorModel model =
      with(level_arm(description), {{"link_bending", "link1", {1 / kEI}, {}}}).with_equilibrium(false);
  const Twists xi = twists(model, posture({0}, 20));
  // The axis is world -y: DH's y is up.
  EXPECT_NEAR(kSag, 8.744263e-4, 1e-10);
  EXPECT_TRUE(xi.col(link_frame(0)).isApprox((Vector6d() << 0, -kSag, 0, 0, 0, -kSlope).finished(), 1e-14));
  EXPECT_NEAR(xi.norm(), xi.col(link_frame(0)).norm(), 0);
}

TEST(LinkBending, AgainstItsLoadItRises) {
  RobotDescription description = level_description();
  description.p_flange_payload = {0.1, 0, 0};
  const Options against{{"sign", std::string("against")}};
  const ErrorModel model =
      with(level_arm(description), {{"link_bending", "link1", {1 / kEI}, against}}).with_equilibrium(false);
  EXPECT_EQ(model.effects()[0]->parameters()[0].name, "excess_inverse_ei");
  const Twists xi = twists(model, posture({0}, 20));
  EXPECT_TRUE(xi.col(link_frame(0)).isApprox((Vector6d() << 0, kSag, 0, 0, 0, kSlope).finished(), 1e-14));
}

TEST(LinkBending, AnUprightLinkDoesNotBend) {
  const ErrorModel model = with(level_arm(), {{"link_bending", "link1", {1 / kEI}, {}}}).with_equilibrium(false);
  EXPECT_LT(twists(model, posture({kHalfPi}, 20)).norm(), 1e-18);
}

TEST(LinkBending, BendsInTheOtherPlaneToo) {
  // 300 N sideways (along the joint's axis) at the end, no weight at all.
  RobotDescription description = level_description();
  description.bodies[0].mass = 0;
  description.wrench_frame = WrenchFrame::kFlange;
  const ErrorModel model = with(level_arm(description), {{"link_bending", "link1", {1 / kEI}, {}}});
  Samples samples = posture({0.7});
  samples.wrench = RowMatrixXd::Zero(1, 6);
  samples.wrench(0, 2) = 300;
  samples.wrench(0, 4) = 40;
  // About y the end turns by -F L^2/2 + M L; the moment about +y bends it towards -z.
  const Vector6d expected = (Vector6d() << 0, 0, 100 - 20, 0, -150 + 40, 0).finished() / kEI;
  EXPECT_TRUE(
      twists(with(level_arm(description), {{"link_bending", "link1", {1 / kEI}, {}}}).with_equilibrium(false), samples)
          .col(link_frame(0))
          .isApprox(expected, 1e-12));
  EXPECT_TRUE(model.at_equilibrium());
}

TEST(LinkBending, TheBeamRunsAsTheTableSays) {
  // MDH: the a of row i + 1 is link i's; where it is 0, the d of its own row.
  RobotDescription description;
  description.joint_types = {JointType::kRevolute, JointType::kRevolute};
  description.bodies.resize(2);
  RowMatrixXd rows = RowMatrixXd::Zero(2, 5);
  rows << 0, 0.7, 0, 0, 0, 0, 0, 0.5, kHalfPi, 0;
  const RobotModel mdh = build_mdh(description, rows);
  EXPECT_TRUE(mdh.link_axis(0).isApprox(Eigen::Vector3d(0.5, 0, 0)));
  EXPECT_TRUE(mdh.link_axis(1).isZero(0));
  EXPECT_EQ(effect_entry("link_bending").owners(mdh), std::vector<std::string>{"link1"});
  EXPECT_THROW(make_effect("link_bending", mdh, "link2", {}), InvalidInput);
  // What an identification leaves of a 0 is no beam, and turns none.
  rows(1, 1) = 4e-4;
  EXPECT_TRUE(build_mdh(description, rows).link_axis(1).isZero(0));
  rows(0, 2) = 4e-4;
  rows(1, 2) = 4e-4;
  EXPECT_TRUE(build_mdh(description, rows).link_axis(0).isApprox(Eigen::Vector3d(0, 0, 0.7)));
  // Nor where the link is short: an a of 0.6 mm beside a d of 20 mm.
  RobotDescription wrist;
  wrist.joint_types = {JointType::kRevolute};
  EXPECT_TRUE(build_dh(wrist, one_row(0, 0.02, 6e-4)).link_axis(0).isApprox(Eigen::Vector3d(0, 0, 0.02)));
  EXPECT_TRUE(build_dh(wrist, one_row(0, 0.02, -0.03)).link_axis(0).isApprox(Eigen::Vector3d(-0.03, 0, 0)));
  // DH with a = 0: a column along z, loaded by 100 N along x at its end.
  RobotDescription column;
  column.joint_types = {JointType::kRevolute};
  column.wrench_frame = WrenchFrame::kFlange;
  const ErrorModel model =
      with(build_dh(column, one_row(0, 2, 0)), {{"link_bending", "link1", {1 / kEI}, {}}}).with_equilibrium(false);
  Samples samples = posture({0});
  samples.wrench = RowMatrixXd::Zero(1, 6);
  samples.wrench(0, 0) = 100;
  const Vector6d expected = (Vector6d() << 100 * 8.0 / 3, 0, 0, 0, 100 * 2, 0).finished() / kEI;
  EXPECT_TRUE(twists(model, samples).col(link_frame(0)).isApprox(expected, 1e-14));
}

/// What it was first fitted on stays its beam, whatever the same fit makes of the table.
TEST(LinkBending, KeepsTheBeamThatItIsGiven) {
  RobotDescription description;
  description.joint_types = {JointType::kRevolute};
  description.wrench_frame = WrenchFrame::kFlange;
  const RowMatrixXd nominal = one_row(0, 0.3, 0);
  Samples samples = posture({0.4});
  samples.wrench = RowMatrixXd::Zero(1, 6);
  samples.wrench.row(0) << 100, 30, -20, 4, -2, 7;
  for (const std::string name : {"link_bending", "link_torsion"}) {
    const auto first = make_effect(name, build_dh(description, nominal), "link1", {});
    ASSERT_EQ(first->reference().size(), 1);
    EXPECT_EQ(first->reference().at("beam").unit, "m");
    const Options kept{{"beam", first->reference().at("beam").values}};
    const Twists expected =
        twists(with(build_dh(description, nominal), {{name, "link1", {1e-3}, {}}}).with_equilibrium(false), samples);
    EXPECT_GT(expected.norm(), 1e-4);
    // An a that passes for the beam's own, and a link that is too short for one.
    for (const RowMatrixXd& identified : {one_row(0.002, 0.301, 0.008), one_row(0.002, 0.0048, 0.001)}) {
      const RobotModel moved = build_dh(description, identified);
      EXPECT_FALSE(moved.link_axis(0).isApprox(Eigen::Vector3d(0, 0, 0.3), 0.1));
      EXPECT_EQ(make_effect(name, moved, "link1", kept)->reference().at("beam").values,
                first->reference().at("beam").values);
      const ErrorModel again = with(moved, {{name, "link1", {1e-3}, kept}}).with_equilibrium(false);
      EXPECT_TRUE(twists(again, samples).isApprox(expected, 1e-12)) << name;
    }
    const RobotModel robot = build_dh(description, nominal);
    EXPECT_THROW(make_effect(name, robot, "link1", {{"beam", std::vector<double>{0, 0.3}}}), InvalidInput);
    EXPECT_THROW(make_effect(name, robot, "link1", {{"beam", std::vector<double>{0, 0, 0}}}), InvalidInput);
    EXPECT_THROW(make_effect(name, robot, "link1", {{"beam", std::vector<double>{0, 0, INFINITY}}}), InvalidInput);
    EXPECT_THROW(make_effect(name, robot, "link1", {{"beam", std::vector<double>{}}}), InvalidInput);
  }
}

}  // namespace
}  // namespace fastcal::test
