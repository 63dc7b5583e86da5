// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/alignment.hpp"

#include <gtest/gtest.h>

#include "support/simulation.hpp"

namespace fastcal {
namespace {

using test::Noise;
using test::Random;
using test::What;

struct Errors {
  double base_m, base_rad, tool_m, tool_rad;
};

Errors errors(const Alignment& found, const Pose& base, const Pose& tool) {
  return {(found.T_world_base.p - base.p).norm(), log_so3(base.R.transpose() * found.T_world_base.R).norm(),
          (found.T_flange_tool.p - tool.p).norm(), log_so3(tool.R.transpose() * found.T_flange_tool.R).norm()};
}

/// The robot file's robot (base and tool at nothing), and where it truly stands.
struct Place {
  Pose base, tool;
  ErrorModel truth;
  ErrorModel nominal;
};

Place random_place(Random& random, const std::string& kind) {
  test::Tables t = test::six_axes();
  if (kind != "dh") {  // another arm: general axes
    Random own(99);
    t = test::random_tables(own, 6);
    t.types.assign(6, JointType::kRevolute);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d axis = own.unit();
      t.screws.row(i) << axis.transpose(), (-axis.cross(own.vector(0.8))).transpose(), 0;
    }
    t.base = Pose();
  }
  t.tool = Pose();
  const RobotModel robot = test::build(kind, t);
  Place out{{random.rotation(), 10 * random.unit()},
            {random.rotation(), random.vector(0.5)},
            ErrorModel(robot),
            ErrorModel(robot)};
  out.truth = ErrorModel(robot.with_base_and_tool(out.base, out.tool));
  return out;
}

TEST(Alignment, AThousandBasesTenMetresAwayAndTurnedAnyWayAreFoundFromPositions) {
  Random random(1);
  for (int trial = 0; trial < test::repeat(1000); ++trial) {
    const Place place = random_place(random, trial % 4 == 3 ? "poe" : "dh");
    const Samples samples = test::postures(random, 30, 6);
    const test::Measured measured =
        test::measure(random, place.truth, samples, place.truth.start(), What::kPositions, {1e-4});
    const Alignment found = align({place.nominal, samples, measured});
    ASSERT_TRUE(found.found);
    const Errors e = errors(found, place.base, place.tool);
    EXPECT_LT(e.base_m, 2e-3) << trial;
    EXPECT_LT(e.base_rad, 2e-3) << trial;
    EXPECT_LT(e.tool_m, 2e-3) << trial;
    EXPECT_LT(found.rms, 3e-4) << trial;
  }
}

TEST(Alignment, AThousandBasesAndToolsAreFoundFromFullPosesOfATwistedArmWithOutliers) {
  Random random(2);
  for (int trial = 0; trial < test::repeat(1000); ++trial) {
    const Place place = random_place(random, trial % 4 == 3 ? "poe" : "dh");
    const Samples samples = test::postures(random, 20, 6);
    Eigen::VectorXd truth = place.truth.start();
    for (Eigen::Index k = 6; k < truth.size() - 6; ++k) truth[k] += random.normal(5e-4);
    test::Measured measured = test::measure(random, place.truth, samples, truth, What::kPoses, {1e-4, 1e-4});
    measured.position.row(4) += random.vector(0.5).transpose();
    const Alignment found = align({place.nominal, samples, measured});
    ASSERT_TRUE(found.found);
    const Errors e = errors(found, place.base, place.tool);
    EXPECT_LT(e.base_m, 2e-2) << trial;
    EXPECT_LT(e.base_rad, 1e-2) << trial;
    EXPECT_LT(e.tool_m, 2e-2) << trial;
    EXPECT_LT(e.tool_rad, 1e-2) << trial;
  }
}

TEST(Alignment, AnchorsOfLengthsAreFoundForARobotThatStaysWhereItIs) {
  Random random(3);
  for (int trial = 0; trial < test::repeat(1000); ++trial) {
    const ErrorModel model(test::build("dh", test::six_axes()));
    const Samples samples = test::postures(random, 36, 6);
    const Eigen::Matrix3Xd anchors = Eigen::Matrix3Xd::NullaryExpr(3, 3, [&] { return random.uniform(-5, 5); });
    test::Measured measured;
    measured.robot = model.robot();
    measured.distance.resize(36);
    measured.anchor.resize(36);
    measured.anchor_count = 3;
    RowEvaluator rows(model, model.start());
    for (Eigen::Index i = 0; i < 36; ++i) {
      measured.anchor[i] = static_cast<int>(i % 3);
      measured.distance[i] = (rows.pose(samples.row(i)).p - anchors.col(i % 3)).norm() + random.normal(1e-5);
    }
    const Alignment found = align({model, samples, measured});
    ASSERT_TRUE(found.found);
    EXPECT_LT((found.unknowns.reshaped(3, 3) - anchors).colwise().norm().maxCoeff(), 1e-3) << trial;
    EXPECT_EQ(found.T_world_base.p, model.robot().description().T_world_base.p);
    EXPECT_LT(found.rms, 5e-5);
  }
}

TEST(Alignment, ExactDataGiveExactFrames) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Place place = random_place(random, "dh");
    const Samples samples = test::postures(random, 40, 6);
    const Alignment found = align(
        {place.nominal, samples, test::measure(random, place.truth, samples, place.truth.start(), What::kPoses, {})});
    const Errors e = errors(found, place.base, place.tool);
    EXPECT_LT(e.base_m + e.base_rad + e.tool_m + e.tool_rad, 1e-7);
    EXPECT_LT(found.rms, 1e-8);
  }
}

TEST(Alignment, FewPointsFindTheBaseOfAKnownTool) {
  Random random(5);
  for (int trial = 0; trial < test::repeat(200); ++trial) {
    const ErrorModel nominal(test::build("dh", test::six_axes()));
    const Pose base{random.rotation(), 10 * random.unit()};
    const ErrorModel truth(nominal.robot().with_base_and_tool(base, nominal.robot().description().T_flange_tool));
    const Samples samples = test::postures(random, 6, 6);
    const Alignment found =
        align({nominal, samples, test::measure(random, truth, samples, truth.start(), What::kPositions, {})});
    ASSERT_TRUE(found.found);
    EXPECT_LT((found.T_world_base.p - base.p).norm(), 1e-5) << trial;
  }
}

// Turning the first joint alone shows a circle: its place is fixed, base and tool behind it are not. No NaN, and the
// circle is met.
TEST(Alignment, PosturesOfOneJointStayFinite) {
  Random random(6);
  const Place place = random_place(random, "dh");
  Samples samples = test::postures(random, 30, 6);
  samples.q.own().rightCols(5).setConstant(0.3);
  const Alignment found =
      align({place.nominal, samples,
             test::measure(random, place.truth, samples, place.truth.start(), What::kPositions, {1e-5})});
  ASSERT_TRUE(found.found);
  EXPECT_TRUE(found.T_world_base.p.allFinite() && found.T_world_base.R.allFinite() &&
              found.T_flange_tool.p.allFinite());
  EXPECT_NEAR(found.T_world_base.R.determinant(), 1, 1e-12);
  EXPECT_LT(found.rms, 1e-4);
}

// Where the flange never turns, base and tool shift together unseen: the tool stays where the robot file has it.
// Turning by less than the arm's errors says no more: 0.5 mm over 1e-7 rad would be a tool of kilometres.
TEST(Alignment, AFlangeThatHardlyTurnsKeepsTheNominalTool) {
  test::Tables t;
  t.types = {JointType::kPrismatic, JointType::kPrismatic, JointType::kPrismatic, JointType::kRevolute,
             JointType::kRevolute};
  t.screws = RowMatrixXd::Zero(5, 7);
  t.screws.block<3, 3>(0, 3).setIdentity();
  t.screws(3, 2) = t.screws(4, 0) = 1;
  t.tool.p = {0.1, -0.05, 0.2};
  const RobotModel robot = test::build("poe", t);
  Random random(8);
  for (const double turn : {0.0, 1e-9, 1e-7, 1e-5}) {
    for (const What what : {What::kPositions, What::kPoses}) {
      const Pose base{random.rotation(), 5 * random.unit()};
      const Pose tool{what == What::kPoses ? random.rotation() : Eigen::Matrix3d::Identity(), t.tool.p};
      const ErrorModel truth(robot.with_base_and_tool(base, tool));
      Samples samples = test::postures(random, 60, 5, 1);
      samples.q.own().rightCols(2) *= turn;
      const Alignment found =
          align({ErrorModel(robot), samples, test::measure(random, truth, samples, truth.start(), what, {5e-4, 1e-4})});
      ASSERT_TRUE(found.found);
      const Errors e = errors(found, base, tool);
      EXPECT_LT(e.tool_m, 0.05) << turn;
      EXPECT_LT(e.base_m, 0.05) << turn;
      EXPECT_LT(e.base_rad, 1e-3) << turn;
      EXPECT_LT(e.tool_rad, 1e-3) << turn;
      EXPECT_LT(found.rms, 1.2e-3) << turn;
    }
  }
}

TEST(Alignment, RowsWithoutAPointAreLeftOut) {
  Random random(7);
  const Place place = random_place(random, "dh");
  const Samples samples = test::postures(random, 60, 6);
  test::Measured measured =
      test::measure(random, place.truth, samples, place.truth.start(), What::kPoses, {1e-5, 1e-5});
  for (Eigen::Index i = 0; i < 60; ++i) {
    if (i % 3 == 0) measured.position(i, i % 2) = std::nan("");
    if (i % 3 == 1) measured.rotation.row(i).setConstant(std::nan(""));
  }
  const Errors e = errors(align({place.nominal, samples, measured}), place.base, place.tool);
  EXPECT_LT(e.base_m + e.tool_m, 1e-3);
  EXPECT_LT(e.base_rad + e.tool_rad, 1e-3);
}

TEST(Alignment, TooFewMeasurementsAreSaidSo) {
  Random random(8);
  const Place place = random_place(random, "dh");
  const Samples samples = test::postures(random, 2, 6);
  test::Measured measured = test::measure(random, place.truth, samples, place.truth.start(), What::kPositions, {});
  const Alignment found = align({place.nominal, samples, measured});
  EXPECT_FALSE(found.found);
  EXPECT_EQ(found.message, "base and tool need at least three measured points or orientations, got 2 and 0");
  measured.position.resize(0, 3);
  measured.distance = Eigen::VectorXd::Ones(2);
  measured.anchor = Eigen::VectorXi::Zero(2);
  measured.anchor_count = 1;
  const Alignment lengths = align({place.nominal, samples, measured});
  EXPECT_FALSE(lengths.found);
  EXPECT_EQ(lengths.message, "each anchor needs at least four lengths");
}

TEST(Alignment, IsTheSameWhateverTheThreads) {
  Random random(9);
  const Place place = random_place(random, "dh");
  const Samples samples = test::postures(random, 700, 6);
  const test::Measured measured =
      test::measure(random, place.truth, samples, place.truth.start(), What::kPoses, {1e-4, 1e-4});
  const Alignment one = align({place.nominal, samples, measured, 1});
  for (const int threads : {2, 5}) {
    const Alignment other = align({place.nominal, samples, measured, threads});
    EXPECT_EQ(one.T_world_base.p, other.T_world_base.p);
    EXPECT_EQ(one.T_world_base.R, other.T_world_base.R);
    EXPECT_EQ(one.T_flange_tool.p, other.T_flange_tool.p);
  }
}

}  // namespace
}  // namespace fastcal
