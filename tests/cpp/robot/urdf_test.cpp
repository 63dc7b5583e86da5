// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/urdf.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {
namespace {

constexpr double kPi = std::numbers::pi;

std::string link(const std::string& name, const std::string& inside = "") {
  return "<link name='" + name + "'>" + inside + "</link>";
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& inside = "") {
  const std::string limit =
      type == "revolute" || type == "prismatic" ? "<limit lower='-1' upper='2' effort='1' velocity='1'/>" : "";
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child + "'/>" +
         limit + inside + "</joint>";
}

std::string robot(const std::string& inside) { return "<robot name='arm'>" + inside + "</robot>"; }

std::string two_links(const std::string& type, const std::string& inside = "") {
  return robot(link("base") + link("tip") + joint("j", type, "base", "tip", inside));
}

/// The message of the InvalidInput that reading `xml` throws.
std::string refusal(const std::string& xml, const std::string& base = "", const std::string& tip = "") {
  try {
    read_urdf(xml, base, tip);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "nothing was refused";
}

const std::string kArm = robot(
    link("world") + link("base") +
    link("upper",
         "<inertial><origin xyz='1 0 0'/><mass value='3'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.2' iyz='0' "
         "izz='0.3'/></inertial>") +
    link("box", "<inertial><mass value='1'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>") +
    link("mount") + link("slide") + link("tool0") +
    joint("fix", "fixed", "world", "base", "<origin xyz='0 0 0.5' rpy='0 0 1.5707963267948966'/>") +
    joint("shoulder", "revolute", "base", "upper", "<origin xyz='1 0 0'/><axis xyz='0 0 2'/>") +
    joint("boxed", "fixed", "upper", "box", "<origin xyz='5 0 0'/>") +
    joint("mounted", "fixed", "upper", "mount", "<origin xyz='0 2 0' rpy='0.3 -0.4 0.5'/>") +
    joint("rail", "prismatic", "mount", "slide", "<origin xyz='0 0 1'/><axis xyz='0 1 0'/>") +
    joint("end", "fixed", "slide", "tool0", "<origin xyz='0.1 0.2 0.3' rpy='0 1.5707963267948966 0'/>"));

TEST(Urdf, FixedJointsAreMergedIntoOriginsAndTheFlange) {
  const UrdfChain chain = read_urdf(kArm, "world", "tool0");
  ASSERT_EQ(chain.joints.size(), 2U);
  EXPECT_EQ(chain.name, "arm");
  EXPECT_EQ(chain.joints[0].name, "shoulder");
  EXPECT_EQ(chain.joints[1].type, JointType::kPrismatic);
  EXPECT_LT((chain.joints[0].origin.p - Eigen::Vector3d(0, 1, 0.5)).norm(), 1e-15);  // Rz(90 deg) turns x into y
  EXPECT_LT((chain.joints[0].axis - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  const Eigen::Matrix3d R = rpy_to_rotation({0.3, -0.4, 0.5});
  EXPECT_LT((chain.joints[1].origin.R - R).norm(), 1e-15);
  EXPECT_LT((chain.joints[1].origin.p - (Eigen::Vector3d(0, 2, 0) + R.col(2))).norm(), 1e-15);
  EXPECT_LT((chain.flange.p - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
  EXPECT_LT((chain.flange.R - rpy_to_rotation({0, kPi / 2, 0})).norm(), 1e-15);
  EXPECT_EQ(chain.joints[0].lower, -1);
  EXPECT_EQ(chain.joints[0].upper, 2);
}

TEST(Urdf, AFixedBodyIsLumpedIntoTheLinkThatCarriesIt) {
  // 3 kg at x = 1 and 1 kg at x = 5: 4 kg at x = 2; 3 kg 1 m away and 1 kg 3 m away add 3 + 9 about y and z.
  const Body body = read_urdf(kArm, "", "tool0").joints[0].body;
  EXPECT_DOUBLE_EQ(body.mass, 4);
  EXPECT_LT((body.com - Eigen::Vector3d(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((body.inertia - Eigen::Vector3d(0.1, 12.2, 12.3).asDiagonal().toDenseMatrix()).norm(), 1e-14);
}

TEST(Urdf, InertiaTurnsWithItsOrigin) {
  const std::string inertial =
      "<inertial><origin xyz='0.1 0.2 0.3' rpy='0.5 0.6 0.7'/><mass value='2'/><inertia ixx='1' ixy='0.1' ixz='0.2' "
      "iyy='2' iyz='0.3' izz='3'/></inertial>";
  const UrdfChain chain =
      read_urdf(robot(link("base") + link("tip", inertial) + joint("j", "revolute", "base", "tip")));
  Eigen::Matrix3d inertia;
  inertia << 1, 0.1, 0.2, 0.1, 2, 0.3, 0.2, 0.3, 3;
  const Eigen::Matrix3d R = rpy_to_rotation({0.5, 0.6, 0.7});
  EXPECT_LT((chain.joints[0].body.inertia - R * inertia * R.transpose()).norm(), 1e-14);
  EXPECT_LT((chain.joints[0].body.com - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
}

TEST(Urdf, AContinuousJointGetsTwoTurnsAndIsNoted) {
  const UrdfChain chain = read_urdf(two_links("continuous", "<axis xyz='0 0 1'/>"));
  EXPECT_EQ(chain.joints[0].type, JointType::kRevolute);
  EXPECT_DOUBLE_EQ(chain.joints[0].lower, -2 * kPi);
  EXPECT_DOUBLE_EQ(chain.joints[0].upper, 2 * kPi);
  ASSERT_EQ(chain.notes.size(), 1U);
  EXPECT_NE(chain.notes[0].find("without limits get -360 and 360 degrees, slides -10 and 10 m: j"), std::string::npos);
}

TEST(Urdf, LimitsThatAreLeftOutAreNoLimits) {
  const std::string ends = "<parent link='base'/><child link='tip'/><limit effort='1' velocity='1'/>";
  for (const std::string type : {"revolute", "prismatic"}) {
    const UrdfChain chain =
        read_urdf(robot(link("base") + link("tip") + "<joint name='j' type='" + type + "'>" + ends + "</joint>"));
    EXPECT_DOUBLE_EQ(chain.joints[0].upper, type == "revolute" ? 2 * kPi : 10.0);
    EXPECT_DOUBLE_EQ(chain.joints[0].lower, -chain.joints[0].upper);
    ASSERT_EQ(chain.notes.size(), 1U);
  }
}

TEST(Urdf, AGripperBesideTheChainIsHeldAndNoted) {
  const std::string finger = link(
      "finger", "<inertial><mass value='0.5'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>");
  const std::string xml = robot(link("base") + link("tip") + finger + joint("j", "revolute", "base", "tip") +
                                joint("grip", "prismatic", "tip", "finger", "<origin xyz='0 0 0.2'/>"));
  const UrdfChain chain = read_urdf(xml, "base", "tip");
  ASSERT_EQ(chain.joints.size(), 1U);
  EXPECT_DOUBLE_EQ(chain.joints[0].body.mass, 0.5);
  EXPECT_LT((chain.joints[0].body.com - Eigen::Vector3d(0, 0, 0.2)).norm(), 1e-15);
  ASSERT_EQ(chain.notes.size(), 1U);
  EXPECT_EQ(chain.notes[0], "joints beside the arm are held at 0 with what they carry: grip");
}

TEST(Urdf, WhatIsNoSerialArmIsRefusedInASentence) {
  EXPECT_NE(refusal("not xml").find("not a URDF"), std::string::npos);
  EXPECT_NE(refusal(robot("")).find("not a URDF"), std::string::npos);
  EXPECT_NE(refusal(robot(link("a") + link("a"))).find("link 'a' is not unique"), std::string::npos);
  EXPECT_NE(refusal(two_links("planar"), "base").find("joint 'j'"), std::string::npos);
  EXPECT_NE(refusal(two_links("floating"), "base").find("joint 'j'"), std::string::npos);
  EXPECT_NE(refusal(two_links("fixed")).find("no joint moves between link 'base' and link 'tip'"), std::string::npos);
  EXPECT_NE(refusal(two_links("revolute", "<axis xyz='0 0 0'/>")).find("no direction"), std::string::npos);
}

TEST(Urdf, TheEndsMustBeOneChain) {
  const std::string fork = robot(link("base") + link("left") + link("right") + joint("l", "revolute", "base", "left") +
                                 joint("r", "revolute", "base", "right"));
  EXPECT_NE(refusal(fork).find("has 2 arms, name the end of one as tip_link: left (1 joint), right (1 joint)"),
            std::string::npos);
  EXPECT_NE(refusal(fork, "", "wrist").find("no link 'wrist'"), std::string::npos);
  EXPECT_NE(refusal(fork, "floor", "left").find("no link 'floor' for base_link; its root is 'base'"),
            std::string::npos);
  EXPECT_NE(refusal(fork, "right", "left").find("'right' does not carry tip_link 'left'"), std::string::npos);
  EXPECT_EQ(read_urdf(fork, "", "left").joints[0].name, "l");
}

TEST(Urdf, TheTipIsChosenWhereThereIsOneWay) {
  // Two flanges on one last joint, beside links that never move: any of them ends the same arm.
  const std::string arm = link("base") + link("plate") + link("upper") + link("camera") + link("lens") +
                          joint("p", "fixed", "base", "plate") + joint("j", "revolute", "base", "upper") +
                          joint("c", "fixed", "upper", "camera") + joint("t", "fixed", "upper", "lens");
  const UrdfChain moved = read_urdf(robot(arm));
  EXPECT_EQ(moved.tip_link, "upper");
  ASSERT_EQ(moved.notes.size(), 1U);
  EXPECT_EQ(moved.notes[0], "tip_link 'upper' was chosen; the URDF also ends in camera, lens, plate");
  const std::string standard = link("tool0") + joint("e", "fixed", "upper", "tool0");
  EXPECT_EQ(read_urdf(robot(arm + standard)).tip_link, "tool0");
  EXPECT_EQ(read_urdf(robot(arm + link("my_tcp") + joint("m", "fixed", "upper", "my_tcp"))).tip_link, "my_tcp");
  // A gripper on them leaves the end of the arm where the controller has it.
  const std::string gripper = link("hand") + link("grip_flange") + joint("g", "fixed", "tool0", "grip_flange") +
                              joint("h", "revolute", "grip_flange", "hand");
  EXPECT_EQ(read_urdf(robot(arm + standard + gripper)).tip_link, "tool0");
  EXPECT_EQ(read_urdf(robot(arm + standard + gripper)).joints.size(), 1U);
  const std::string flange = link("flange") + joint("e", "fixed", "upper", "flange");
  const std::string body =
      link("body") + link("body_tcp") + joint("g", "fixed", "flange", "body") + joint("h", "fixed", "body", "body_tcp");
  EXPECT_EQ(read_urdf(robot(arm + flange + body)).tip_link, "flange");
  const std::string own = link("tool") + joint("k", "fixed", "flange", "tool");  // as fastcal writes a robot's tool
  EXPECT_EQ(read_urdf(robot(arm + flange + own)).tip_link, "tool");
  EXPECT_EQ(read_urdf(robot(arm + standard + link("flange") + joint("f", "fixed", "upper", "flange"))).tip_link,
            "tool0");
  const std::string second = link("other") + joint("o", "revolute", "base", "other");
  EXPECT_EQ(read_urdf(robot(arm + standard + second)).tip_link, "tool0");
  EXPECT_NE(refusal(robot(arm + second)).find("has 2 arms, name the end of one as tip_link: other (1 joint), upper"),
            std::string::npos);
  EXPECT_NE(refusal(robot(arm + second), "upper").find("no joint moves between link 'upper' and link 'camera'"),
            std::string::npos);
}

TEST(Urdf, AnArmBeginsBelowAFloatingJoint) {
  const std::string xml = robot(link("world") + link("body") + link("arm") + joint("f", "floating", "world", "body") +
                                joint("j", "revolute", "body", "arm"));
  const UrdfChain chain = read_urdf(xml);
  EXPECT_EQ(chain.base_link, "body");
  EXPECT_EQ(chain.tip_link, "arm");
  EXPECT_EQ(chain.notes[0], "base_link 'body' was chosen: the joint above it is floating or planar");
  EXPECT_NE(refusal(xml, "world").find("joint 'f'"), std::string::npos);
}

std::string lift(const std::string& first, const std::string& second) {
  return robot(link("base") + link("a") + link("b") + joint("j", "prismatic", "base", "a", first) +
               joint("k", "prismatic", "a", "b", second));
}

TEST(Urdf, AMimicFollowsTheJointThatDrivesIt) {
  const UrdfChain chain = read_urdf(lift("", "<mimic joint='j' multiplier='2' offset='0.1'/>"));
  ASSERT_TRUE(chain.joints[1].mimic.has_value());
  EXPECT_FALSE(chain.joints[0].mimic.has_value());
  EXPECT_EQ(chain.joints[1].mimic->driver, 0);
  EXPECT_EQ(chain.joints[1].mimic->multiplier, 2);
  EXPECT_EQ(chain.joints[1].mimic->offset, 0.1);

  // A mimic of a mimic: 3 (2 q + 0.1) - 0.5.
  const std::string row = robot(link("base") + link("a") + link("b") + link("c") + joint("j", "revolute", "base", "a") +
                                joint("k", "revolute", "a", "b", "<mimic joint='j' multiplier='2' offset='0.1'/>") +
                                joint("l", "revolute", "b", "c", "<mimic joint='k' multiplier='3' offset='-0.5'/>"));
  const Mimic last = read_urdf(row).joints[2].mimic.value_or(Mimic{});
  EXPECT_EQ(last.driver, 0);
  EXPECT_DOUBLE_EQ(last.multiplier, 6);
  EXPECT_DOUBLE_EQ(last.offset, -0.2);
}

TEST(Urdf, AMimicWithoutADriverOnTheChainMovesByItself) {
  const std::string xml = robot(link("base") + link("left") + link("right") + joint("l", "revolute", "base", "left") +
                                joint("r", "revolute", "base", "right", "<mimic joint='l'/>"));
  const UrdfChain chain = read_urdf(xml, "", "right");
  EXPECT_FALSE(chain.joints[0].mimic.has_value());
  EXPECT_EQ(chain.notes[0],
            "joint 'r' mimics joint 'l', which is not between the base and the tip: give its own position");
  EXPECT_FALSE(read_urdf(lift("", "<mimic joint='none'/>")).joints[1].mimic.has_value());
  EXPECT_NE(refusal(lift("<mimic joint='k'/>", "<mimic joint='j'/>")).find("in the end mimics itself"),
            std::string::npos);
}

TEST(Urdf, SlidesOfOneMotorBesideTheChainMoveTogether) {
  // A column of two stages: motor d is a joint of its own that carries nothing.
  const std::string xml =
      robot(link("base") + link("reading") + link("middle") + link("top") + joint("d", "prismatic", "base", "reading") +
            joint("m", "prismatic", "base", "middle", "<mimic joint='d' multiplier='0.5' offset='-0.706'/>") +
            joint("t", "prismatic", "middle", "top", "<mimic joint='d' multiplier='0.25' offset='-0.736'/>"));
  const UrdfChain chain = read_urdf(xml, "", "top");
  EXPECT_FALSE(chain.joints[0].mimic.has_value());
  EXPECT_EQ(chain.notes[0],
            "joint 'm' mimics joint 'd', which is not between the base and the tip: give its own position");
  const Mimic second = chain.joints[1].mimic.value_or(Mimic{});
  EXPECT_EQ(second.driver, 0);
  const double d = 1.98;
  EXPECT_NEAR(second.multiplier * (0.5 * d - 0.706) + second.offset, 0.25 * d - 0.736, 1e-15);
}

TEST(Urdf, HostileTextEndsInASentence) {
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  EXPECT_NE(refusal(deep).find("more than 1000 deep"), std::string::npos);
  const std::string ring =
      robot(link("base") + link("a") + link("b") + joint("j", "revolute", "a", "b") + joint("k", "revolute", "b", "a"));
  EXPECT_NE(refusal(ring, "base", "a").find("does not carry tip_link 'a'"), std::string::npos);
}

}  // namespace
}  // namespace fastcal
