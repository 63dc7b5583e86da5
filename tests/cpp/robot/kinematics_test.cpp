// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Chains of all four kinds against KDL, whose segments are written here from the file format's definitions; and their
// Jacobians against differences, far from the nominal values too.
#include "fastcal/robot/kinematics.hpp"

#include <gtest/gtest.h>

#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>

#include "fastcal/math/check.hpp"
#include "fastcal/model/error_model.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

using test::Random;
using test::Tables;

KDL::Vector kdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
KDL::Frame kdl(const Pose& T) {
  KDL::Frame F(
      KDL::Rotation(T.R(0, 0), T.R(0, 1), T.R(0, 2), T.R(1, 0), T.R(1, 1), T.R(1, 2), T.R(2, 0), T.R(2, 1), T.R(2, 2)),
      kdl(T.p));
  return F;
}
KDL::Frame turn(const KDL::Rotation& R) { return KDL::Frame(R); }
KDL::Frame shift(double x, double y, double z) { return KDL::Frame(KDL::Vector(x, y, z)); }

/// The chain as formats.md defines it: fixed and moving segments.
KDL::Chain kdl_chain(const std::string& kind, const Tables& t) {
  KDL::Chain chain;
  const auto fixed = [&chain](const KDL::Frame& F) { chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), F)); };
  fixed(kdl(t.base));
  for (int i = 0; i < t.joint_count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const bool revolute = t.types[k] == JointType::kRevolute;
    const KDL::Joint along_z(revolute ? KDL::Joint::RotZ : KDL::Joint::TransZ);
    const auto row = t.rows.row(i);
    const KDL::Frame Rz = turn(KDL::Rotation::RotZ(row[0]));
    const KDL::Frame Tz = shift(0, 0, row[1]);
    const KDL::Frame Tx = shift(row[2], 0, 0);
    const KDL::Frame Rx = turn(KDL::Rotation::RotX(row[3]));
    const KDL::Frame Ry = turn(KDL::Rotation::RotY(row[4]));
    const auto moving = revolute ? KDL::Joint::RotAxis : KDL::Joint::TransAxis;
    if (kind == "dh") {
      chain.addSegment(KDL::Segment(along_z, Rz * Tz * Tx * Rx * Ry));
    } else if (kind == "mdh") {
      fixed(Rx * Tx);
      chain.addSegment(KDL::Segment(along_z, Rz * Tz * Ry));
    } else if (kind == "poe") {
      // The tip lies in the base's axes at q = 0: a segment then is a motion about or along a line in space.
      const Eigen::Vector3d omega = t.screws.row(i).head<3>();
      const Eigen::Vector3d v = t.screws.row(i).segment<3>(3);
      const KDL::Joint joint(kdl(revolute ? Eigen::Vector3d(omega.cross(v)) : Eigen::Vector3d(0, 0, 0)),
                             kdl(revolute ? omega : v), moving);
      chain.addSegment(KDL::Segment(joint, KDL::Frame::Identity()));
    } else {
      const Eigen::Vector3d rpy = t.origin_rpy[k];
      fixed(KDL::Frame(KDL::Rotation::RPY(rpy.x(), rpy.y(), rpy.z()), kdl(t.origin_xyz[k])));
      const Eigen::Vector3d axis = t.axes.row(i);
      chain.addSegment(KDL::Segment(KDL::Joint(KDL::Vector::Zero(), kdl(axis), moving), KDL::Frame::Identity()));
    }
  }
  if (kind == "poe" || kind == "urdf") fixed(kdl(t.end));
  fixed(kdl(t.tool));
  return chain;
}

class EveryKind : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind, ::testing::ValuesIn(test::kKinds4),
                         [](const auto& kind) { return std::string(kind.param); });

TEST_P(EveryKind, ForwardKinematicsAgreesWithKdl) {
  Random random(11);
  double worst = 0;
  int prismatic = 0;
  for (int robot = 0; robot < test::repeat(200); ++robot) {
    const Tables t = test::random_tables(random, random.whole(1, 8));
    const KDL::Chain chain = kdl_chain(GetParam(), t);
    KDL::ChainFkSolverPos_recursive solver(chain);
    const RobotModel model = test::build(GetParam(), t);
    prismatic += static_cast<int>(std::count(t.types.begin(), t.types.end(), JointType::kPrismatic));
    std::vector<Pose> frames;
    for (int k = 0; k < 50; ++k) {
      const Eigen::VectorXd q = random.values(t.joint_count(), 3);
      KDL::JntArray q_kdl(static_cast<unsigned>(t.joint_count()));
      for (int i = 0; i < t.joint_count(); ++i)
        q_kdl(static_cast<unsigned>(i)) = q[i] + (std::string(GetParam()) == "poe" ? t.screws(i, 6) : 0);
      KDL::Frame F;
      ASSERT_GE(solver.JntToCart(q_kdl, F), 0);
      forward(model.chain(), q.data(), nullptr, frames);
      const Pose& T = frames.back();
      for (int a = 0; a < 3; ++a) {
        worst = std::max(worst, std::abs(T.p[a] - F.p(a)));
        for (int b = 0; b < 3; ++b) worst = std::max(worst, std::abs(T.R(a, b) - F.M(a, b)));
      }
    }
  }
  EXPECT_LT(worst, 1e-12);
  EXPECT_GT(prismatic, 0);
}

/// Derivative of the tool's motion [v; w] by parameter k, by a stencil of five points.
Vector6d difference(const ErrorModel& model, const State& state, const Eigen::VectorXd& theta, int k) {
  constexpr double h = 1e-3;
  const Eigen::Matrix3d R = RowEvaluator(model, theta).pose(state).R;
  Eigen::Vector3d dp = Eigen::Vector3d::Zero();
  Eigen::Matrix3d dR = Eigen::Matrix3d::Zero();
  for (const auto& [step, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
    Eigen::VectorXd moved = theta;
    moved[k] += step * h;
    const Pose T = RowEvaluator(model, moved).pose(state);
    dp += weight / (12 * h) * T.p;
    dR += weight / (12 * h) * T.R;
  }
  const Eigen::Matrix3d W = dR * R.transpose();
  Vector6d out;
  out << dp, W(2, 1) - W(1, 2), W(0, 2) - W(2, 0), W(1, 0) - W(0, 1);
  out.tail<3>() /= 2;
  return out;
}

void expect_exact_jacobian(const RobotModel& robot, const Eigen::VectorXd& theta, Random& random) {
  const ErrorModel model(robot);
  Samples samples;
  samples.q = random.values(robot.joint_count(), 3).transpose();
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.parameter_count());
  RowEvaluator evaluator(model, theta);
  evaluator.jacobian(samples.row(0), J);
  for (int k = 0; k < model.parameter_count(); ++k) {
    const Vector6d wanted = difference(model, samples.row(0), theta, k);
    EXPECT_LT((J.col(k) - wanted).norm(), 1e-7 * wanted.norm() + 1e-10)
        << robot.parameters()[static_cast<std::size_t>(k)].owner << " "
        << robot.parameters()[static_cast<std::size_t>(k)].name;
  }
}

TEST_P(EveryKind, EveryJacobianColumnIsTheDerivativeAtNominal) {
  Random random(12);
  for (int robot = 0; robot < test::repeat(200); ++robot) {
    const RobotModel model = test::build(GetParam(), test::random_tables(random, random.whole(1, 7)));
    expect_exact_jacobian(model, model.nominal(), random);
  }
}

// A radian and a metre away from nominal: the parametrisation is exact, not a small-error model.
TEST_P(EveryKind, EveryJacobianColumnIsTheDerivativeFarFromNominal) {
  Random random(13);
  for (int robot = 0; robot < test::repeat(200); ++robot) {
    const RobotModel model = test::build(GetParam(), test::random_tables(random, random.whole(1, 7)));
    expect_exact_jacobian(model, model.nominal() + random.values(model.nominal().size(), 1), random);
  }
}

TEST_P(EveryKind, EveryJacobianColumnIsTheDerivativeFromOtherReferences) {
  Random random(14);
  for (int robot = 0; robot < test::repeat(100); ++robot) {
    const RobotModel model =
        test::build(GetParam(), test::random_tables(random, 4)).with_base_and_tool(random.pose(10), random.pose(1));
    expect_exact_jacobian(model, model.nominal() + random.values(model.nominal().size(), 0.5), random);
  }
}

TEST_P(EveryKind, NewReferencesOfBaseAndToolChangeNothingElse) {
  Random random(15);
  Tables t = test::random_tables(random, 6);
  const RobotModel old = test::build(GetParam(), t);
  t.base = random.pose(10);
  t.tool = random.pose(1);
  const RobotModel wanted = test::build(GetParam(), t);
  const RobotModel moved = old.with_base_and_tool(t.base, t.tool);
  const Eigen::VectorXd q = random.values(6, 3);
  std::vector<Pose> a;
  std::vector<Pose> b;
  forward(wanted.chain(), q.data(), nullptr, a);
  forward(moved.chain(), q.data(), nullptr, b);
  EXPECT_EQ(a.back().p, b.back().p);
  EXPECT_EQ(a.back().R, b.back().R);
  EXPECT_EQ(wanted.nominal(), moved.nominal());
}

// Rows identified in any kind are what a user writes back into his file: rebuilt from them, the robot is the same.
TEST(Kinematics, IdentifiedRowsAreTheRowsOfTheRobot) {
  Random random(16);
  for (const char* kind : {"dh", "mdh"}) {
    Tables t = test::random_tables(random, 6);
    const RobotModel nominal = test::build(kind, t);
    const RowMatrixXd change = RowMatrixXd::NullaryExpr(6, 5, [&] { return random.uniform(-0.5, 0.5); });
    Eigen::VectorXd theta = nominal.nominal();
    for (std::size_t k = 0; k < nominal.parameters().size(); ++k) {
      const Parameter& p = nominal.parameters()[k];
      if (p.owner.rfind("joint", 0) != 0) continue;
      const std::vector<std::string> columns{"theta", "d", "a", "alpha", "beta"};
      const auto column = std::find(columns.begin(), columns.end(), p.name) - columns.begin();
      theta[static_cast<Eigen::Index>(k)] += change(std::stoi(p.owner.substr(5)) - 1, column);
    }
    t.rows += change;
    const Eigen::VectorXd q = random.values(6, 3);
    std::vector<Pose> a;
    std::vector<Pose> b;
    forward(nominal.chain(theta), q.data(), nullptr, a);
    forward(test::build(kind, t).chain(), q.data(), nullptr, b);
    EXPECT_LT((a.back().p - b.back().p).norm(), 1e-14) << kind;
    EXPECT_LT((a.back().R - b.back().R).norm(), 1e-14) << kind;
  }
}

// A wrist turned by the shift of a POE axis: the whole line moves, seen at q = 0 as no motion at all and at pi as twice
// the shift.
TEST(Kinematics, AShiftedScrewMovesTheToolByTheTurnsShareOfIt) {
  Tables t;
  t.types = {JointType::kRevolute};
  t.screws.resize(1, 7);
  t.screws << 0, 0, 1, 0, 0, 0, 0;
  const RobotModel robot = test::build("poe", t);
  Eigen::VectorXd theta = robot.nominal();
  theta[6] = 0.25;  // joint1 x
  ASSERT_EQ(robot.parameters()[6].name, "x");
  std::vector<Pose> frames;
  double q = 0;
  forward(robot.chain(theta), &q, nullptr, frames);
  EXPECT_LT(frames.back().p.norm(), 1e-15);
  q = test::kPi;
  forward(robot.chain(theta), &q, nullptr, frames);
  EXPECT_LT((frames.back().p - Eigen::Vector3d(0.5, 0, 0)).norm(), 1e-15);
}

TEST(Kinematics, FramesHaveNamesInTheOrderOfTheChain) {
  const RobotModel robot = test::build("dh", test::six_axes());
  EXPECT_EQ(robot.frame_name(0), "base");
  EXPECT_EQ(robot.frame_name(1), "joint1");
  EXPECT_EQ(robot.frame_name(2), "link1");
  EXPECT_EQ(robot.frame_name(12), "link6");
  EXPECT_EQ(robot.frame_name(13), "tool");
  EXPECT_EQ(robot.frame_count(), 14);
}

TEST(Kinematics, ToolMotionIsThatOfARigidBody) {
  Random random(17);
  const Pose T = random.pose(2);
  const Eigen::Vector3d p_tool = random.vector(2);
  Vector6d xi;
  xi << random.vector(1), random.vector(1);
  constexpr double h = 1e-5;
  const auto moved = [&](double by) { return T * (exp_se3(by * xi) * (T.inverse() * p_tool)); };
  const Vector6d motion = tool_motion(T, p_tool, xi);
  EXPECT_LT((motion.head<3>() - (moved(h) - moved(-h)) / (2 * h)).norm(), 1e-9);
  EXPECT_LT((motion.tail<3>() - T.R * xi.tail<3>()).norm(), 1e-15);
}

/// The sentence of the InvalidInput that building throws.
template <typename F>
std::string refusal(const F& f) {
  try {
    f();
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "nothing was refused";
}

TEST(Builders, BadGeometryIsRefusedInASentence) {
  Random random(18);
  const Tables good = test::random_tables(random, 3);
  const auto with = [&](const char* kind, const auto& spoil) {
    Tables t = good;
    t.types = {JointType::kRevolute, JointType::kRevolute, JointType::kPrismatic};
    t.screws.row(1) << 0, 0, 1, 0.5, 0.2, 0, 0;
    t.screws.row(2) << 0, 0, 0, 0, 0, 1, 0;
    spoil(t);
    return refusal([&] { test::build(kind, t); });
  };
  const double nan = std::nan("");
  EXPECT_EQ(with("dh", [&](Tables& t) { t.rows(1, 2) = nan; }), "joint2 a must be a finite number, got nan");
  EXPECT_EQ(with("mdh", [&](Tables& t) { t.rows.conservativeResize(2, 5); }),
            "the geometry table must be 3 x 5, got 2 x 5");
  EXPECT_EQ(with("poe", [&](Tables& t) { t.screws(1, 5) = 0.3; }),
            "joint2: v must be perpendicular to omega (a screw without pitch), got omega . v = 0.3");
  EXPECT_EQ(with("poe", [&](Tables& t) { t.screws(2, 5) = 2; }),
            "joint3: the screw's direction must have length 1, got 2");
  EXPECT_EQ(with("urdf", [&](Tables& t) { t.axes.row(0) << 0, 0, 3; }), "joint1: the axis must have length 1, got 3");
  EXPECT_EQ(with("dh", [&](Tables& t) { t.base.p.x() = nan; }), "base and tool must be finite");
  EXPECT_EQ(with("dh",
                 [&](Tables& t) {
                   t.types.clear();
                   t.rows.resize(0, 5);
                 }),
            "a robot needs at least one joint, got none");
}

TEST(Builders, RotationToAnAxisHasItAsItsZ) {
  Random random(19);
  std::vector<Eigen::Vector3d> axes{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}};
  for (int k = 0; k < 16; ++k) {
    axes.push_back(Eigen::Vector3d(0, std::pow(10, -k), -1).normalized());
    axes.push_back(Eigen::Vector3d(std::pow(10, -k), 0, 1).normalized());
  }
  for (int k = 0; k < 1000; ++k) axes.push_back(random.unit());
  for (const Eigen::Vector3d& axis : axes) {
    const Eigen::Matrix3d R = rotation_to_axis(axis);
    EXPECT_LT((R.col(2) - axis).norm(), 5e-15) << axis.transpose();
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 5e-15) << axis.transpose();
    EXPECT_NEAR(R.determinant(), 1, 5e-15) << axis.transpose();
  }
}

// Else the tilts that a calibration identified about x and y would turn into others when its file is read again.
TEST(Builders, ASlightlyTiltedAxisGetsASlightlyTurnedFrame) {
  Random random(20);
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)}) {
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d tilted = (axis + 1e-3 * random.unit()).normalized();
      EXPECT_LT(log_so3(rotation_to_axis(axis).transpose() * rotation_to_axis(tilted)).norm(), 2.5e-3);
    }
  }
}

}  // namespace
}  // namespace fastcal
