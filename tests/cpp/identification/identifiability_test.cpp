// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identifiability.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "fastcal/effects/registry.hpp"
#include "support/simulation.hpp"

namespace fastcal {
namespace {

using test::Random;
using test::What;

std::vector<Parameter> named(const std::vector<std::string>& names, const std::string& unit) {
  std::vector<Parameter> out;
  for (const std::string& text : names) {
    const auto space = text.find(' ');
    out.push_back({text.substr(0, space), text.substr(space + 1), unit, 1e-3, ""});
  }
  return out;
}

/// R of an arm whose data have noise 0.1 mm and 0.1 mrad, columns scaled by plausible sizes.
struct Seen {
  ErrorModel model;
  std::vector<int> asked;
  std::vector<Parameter> parameters;
  Eigen::MatrixXd R;
  Gauge gauge;
};

Seen look(const RobotModel& robot, What what, std::uint64_t seed = 1, Eigen::Index rows = 80, double reach = 2.5) {
  Random random(seed);
  Seen seen{ErrorModel(robot), {}, {}, {}, {}};
  seen.asked = test::asked(seen.model, what);
  const Samples samples = test::postures(random, rows, robot.joint_count(), reach);
  const test::Measured measured = test::measure(random, seen.model, samples, seen.model.start(), what, {});
  Eigen::VectorXd scale(static_cast<Eigen::Index>(seen.asked.size()));
  Eigen::VectorXd hold(scale.size());
  for (Eigen::Index k = 0; k < scale.size(); ++k) {
    seen.parameters.push_back(
        seen.model.parameters()[static_cast<std::size_t>(seen.asked[static_cast<std::size_t>(k)])]);
    scale[k] = seen.parameters.back().sigma;
    hold[k] = fixing_priority(seen.parameters.back()) *
              (1 - 1e-3 * static_cast<double>(k) / static_cast<double>(scale.size()));
  }
  seen.R =
      triangular_factor({seen.model, samples, measured}, seen.model.start(), seen.asked, scale, {{1e-4, 1e-4, 1e-4}});
  seen.gauge = choose_gauge(seen.R, hold);
  return seen;
}

std::set<std::string> held(const Seen& seen) {
  std::set<std::string> out;
  for (const int k : seen.gauge.held) {
    const Parameter& p = seen.parameters[static_cast<std::size_t>(k)];
    out.insert(p.owner + " " + p.name);
  }
  return out;
}

// Any 6R arm, parallel axes or not: four numbers an axis, and six for base and tool; a point shows nothing of the
// tool's turn.
TEST(Rank, Is27FromPositionsAnd30FromPosesForSixAxesTwoOfThemParallel) {
  for (const double angle : {0.0, 1e-12, 1e-6, 1e-3, 0.5}) {
    EXPECT_EQ(look(test::build("dh", test::six_axes(angle)), What::kPositions).gauge.rank, 27) << angle;
    EXPECT_EQ(look(test::build("dh", test::six_axes(angle)), What::kPoses).gauge.rank, 30) << angle;
  }
}

/// (joints, prismatic ones): 4 R + 2 P + 6 numbers fix an arm (L. Everett, M. Driels, B. Mooring 1987).
TEST(Rank, IsThatOfTheArmWhateverItsFileSays) {
  Random random(2);
  for (const char* kind : test::kKinds4) {
    for (int trial = 0; trial < 6; ++trial) {
      const test::Tables t = test::random_tables(random, random.whole(3, 7));
      const auto prismatic = static_cast<int>(std::count(t.types.begin(), t.types.end(), JointType::kPrismatic));
      if (t.joint_count() - prismatic < 3) continue;  // an arm that hardly turns shows less
      const int wanted = 4 * (t.joint_count() - prismatic) + 2 * prismatic + 6;
      const RobotModel robot = test::build(kind, t);
      EXPECT_EQ(look(robot, What::kPoses).gauge.rank, wanted)
          << kind << ", " << prismatic << " of " << t.joint_count() << " prismatic";
    }
  }
}

TEST(Gauge, WhatIsHeldMakesEveryDirectionThatDoesNothing) {
  for (const char* kind : test::kKinds4) {
    Random random(3);
    const Seen seen = look(test::build(kind, test::random_tables(random, 6)), What::kPositions);
    const Gauge& gauge = seen.gauge;
    ASSERT_GT(gauge.held.size(), 0U);
    EXPECT_EQ(gauge.free.size() + gauge.held.size(), seen.asked.size());
    const Eigen::MatrixXd effect = seen.R * gauge.directions;
    for (Eigen::Index k = 0; k < gauge.directions.cols(); ++k) {
      EXPECT_LE(effect.col(k).norm(), 0.11 * gauge.directions.col(k).norm())
          << kind;  // at most one deviation for ten plausible sizes
      for (Eigen::Index j = 0; j < gauge.directions.cols(); ++j)
        EXPECT_NEAR(gauge.directions(gauge.held[static_cast<std::size_t>(j)], k), j == k ? 1 : 0, 1e-6);
    }
    Eigen::MatrixXd R_free(seen.R.rows(), static_cast<Eigen::Index>(gauge.free.size()));
    for (std::size_t k = 0; k < gauge.free.size(); ++k)
      R_free.col(static_cast<Eigen::Index>(k)) = seen.R.col(gauge.free[k]);
    EXPECT_GT(R_free.jacobiSvd().singularValues().tail<1>()[0], 1e-3) << kind << ": what is free can be told";
  }
}

TEST(Gauge, BaseAndToolAreFreeAndBetaIsHeldWhereAxesCross) {
  const std::set<std::string> names = held(look(test::build("dh", test::six_axes(0.7)), What::kPositions));
  for (const std::string& name : names) EXPECT_TRUE(name.rfind("joint", 0) == 0) << name;
  for (int joint = 1; joint <= 5; ++joint) EXPECT_TRUE(names.count("joint" + std::to_string(joint) + " beta")) << joint;
}

TEST(Gauge, ParallelAxesHoldTheirDAndFreeBeta) {
  for (const double angle : {0.0, 1e-9, 1e-6, 1e-4, 1e-3}) {
    for (const char* kind : {"dh", "mdh"}) {
      test::Tables t = test::six_axes(angle);
      if (std::string(kind) == "mdh") {
        // The same arm in Craig's rows: a and alpha move one row on.
        for (int i = 5; i > 0; --i) t.rows.block<1, 2>(i, 2) = t.rows.block<1, 2>(i - 1, 2).eval();
        t.rows.block<1, 2>(0, 2).setZero();
      }
      const std::set<std::string> names = held(look(test::build(kind, t), What::kPositions));
      const std::string beta = "joint2 beta";
      EXPECT_EQ(names.count(beta), 0U) << kind << " " << angle;
      EXPECT_EQ(names.count("joint2 d") + names.count("joint3 d"), 1U) << kind << " " << angle;
    }
  }
}

std::vector<std::string> words(const Seen& seen) { return describe_directions(seen.gauge, seen.parameters); }

bool says(const std::vector<std::string>& sentences, const std::string& wanted) {
  return std::find(sentences.begin(), sentences.end(), wanted) != sentences.end();
}

TEST(Words, TellWhatMovesTogether) {
  test::Tables t = test::six_axes();
  t.tool.p = {0, 0, 0.15};
  const std::vector<std::string> on_axis = words(look(test::build("dh", t), What::kPositions));
  EXPECT_TRUE(says(on_axis, "joint1 d and base z move together"));
  EXPECT_TRUE(says(on_axis, "joint1 theta and base rz turn together"));
  EXPECT_TRUE(says(on_axis, "joint6 d and tool z move together"));
  EXPECT_TRUE(says(on_axis, "joint6 theta is not observable"));
  t.tool.p = {0.1, 0, 0.15};
  EXPECT_TRUE(says(words(look(test::build("dh", t), What::kPositions)), "joint6 theta and tool y move together"));
  const std::vector<std::string> poses = words(look(test::build("dh", t), What::kPoses));
  EXPECT_TRUE(std::any_of(poses.begin(), poses.end(), [](const std::string& text) {
    return text.rfind("joint6 theta", 0) == 0 && text.find("tool rz") != std::string::npos;
  }));
}

TEST(Words, AreOneSentenceADirection) {
  // p1 and p2 show only their sum, p3 only through noise, p4 nothing, p5 all.
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(5, 5);
  R.row(0) << 100, 100, 0, 0, 0;
  R(1, 2) = 0.01;
  R(2, 4) = 50;
  const Gauge gauge = choose_gauge(R, Eigen::Vector<double, 5>(1, 3, 1, 1, 1));
  EXPECT_EQ(gauge.rank, 3);  // p3 does something, too little to be told
  EXPECT_EQ(gauge.free, (std::vector<int>{0, 4}));
  EXPECT_EQ(gauge.held, (std::vector<int>{1, 2, 3}));
  const auto sentences =
      describe_directions(gauge, named({"joint1 a", "joint1 d", "joint2 a", "joint2 d", "joint3 a"}, "m"));
  EXPECT_EQ(sentences[0], "joint1 d and joint1 a move together");
  EXPECT_EQ(sentences[2], "joint2 d is not observable");
}

TEST(Words, NameAParameterWithoutANameByItsUnit) {
  Gauge gauge;
  gauge.held = {0};
  gauge.directions = Eigen::Vector2d(0, 0);
  EXPECT_EQ(describe_directions(gauge, named({"joint3 ", "joint3 theta"}, "rad_nm")),
            std::vector<std::string>{"joint3 rad_nm is not observable"});
}

/// Whatever an effect's parameter is called: "a" beside the geometry's own a, or nothing at all.
TEST(Gauge, AnEffectIsHeldRatherThanTheGeometry) {
  for (const char* name : {"joint1 a", "joint1 ", "joint1 gap"}) {
    std::vector<Parameter> parameters = named({"joint1 a", name}, "rad");
    parameters[1].of_effect = true;
    EXPECT_GT(fixing_priority(parameters[1]), fixing_priority(parameters[0])) << name;
  }
}

/// Without the set-up of each station no arm is measured: it is kept as the base is.
TEST(Gauge, ASetUpIsKeptRatherThanTheGeometry) {
  std::vector<Parameter> parameters = named({"joint1 a", "base station2_x"}, "m");
  parameters[1].of_effect = true;
  EXPECT_LT(fixing_priority(parameters[1]), fixing_priority(parameters[0]));
}

TEST(Gauge, TheModelMarksTheParametersOfEffects) {
  const RobotModel robot = test::build("dh", test::six_axes(0.1));
  const ErrorModel model(robot, {make_effect("thermal_offset", robot, "joint1", {})});
  for (std::size_t i = 0; i < model.parameters().size(); ++i)
    EXPECT_EQ(model.parameters()[i].of_effect, i + 1 == model.parameters().size());
}

TEST(Words, StopAfterFiveNames) {
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(8, 8);
  R.row(0).setConstant(100);
  for (int k = 0; k < 6; ++k) R(k + 1, k) = 100;
  R.row(7).setZero();
  // Seven columns tied by one free direction: x7 = -(sum of nothing else); columns 0 ... 5 are fixed, 6 and 7 only by
  // their sum.
  const Gauge gauge = choose_gauge(R, Eigen::VectorXd::Ones(8));
  EXPECT_EQ(gauge.held.size(), 1U);
  Gauge wide = gauge;
  wide.directions = Eigen::VectorXd::Ones(8);
  wide.held = {0};
  const auto sentences = describe_directions(
      wide,
      named({"joint1 a", "joint1 d", "joint2 a", "joint2 d", "joint3 a", "joint3 d", "joint4 a", "joint4 d"}, "m"));
  EXPECT_EQ(sentences[0], "joint1 a, joint1 d, joint2 a, joint2 d, joint3 a, joint3 d and 2 more move together");
}

/// Eight clear singular values, two of nothing, and one that lies anywhere, on both sides of both limits.
TEST(Gauge, RankAndHeldAreThoseOfTheSingularValuesHoweverNearALimit) {
  Random random(8);
  constexpr Eigen::Index kCount = 11;
  for (const double last : {30.0, 0.2, 0.101, 0.099, 0.05, 1e-3, 1e-5, 1.1e-6, 0.9e-6, 1e-7, 1e-9, 1e-13, 0.0}) {
    const auto turned = [&]() -> Eigen::MatrixXd {
      return Eigen::MatrixXd::NullaryExpr(kCount, kCount, [&] { return random.normal(); })
          .householderQr()
          .householderQ();
    };
    Eigen::VectorXd values(kCount);
    values << 1e3, 800, 500, 300, 90, 20, 7, 3, last, 0, 0;
    const Eigen::MatrixXd V = turned();
    const Eigen::MatrixXd R = turned() * values.asDiagonal() * V.transpose();
    const Gauge gauge = choose_gauge(R, Eigen::VectorXd::Ones(kCount));
    EXPECT_EQ(gauge.rank, last > 1e-9 * 1e3 ? 9 : 8) << last;
    const bool told = last >= 0.1;
    EXPECT_EQ(gauge.held.size(), told ? 2U : 3U) << last;
    // The directions span the right singular vectors that are lost.
    const Eigen::MatrixXd kept = V.leftCols(told ? 9 : 8);
    const Eigen::VectorXd along = (kept.transpose() * gauge.directions).colwise().norm();
    EXPECT_LE(along.maxCoeff(), 1e-9 * gauge.directions.norm()) << last;
  }
}

TEST(Gauge, AFactorPartsClearlyOnlyWhereNothingIsLeftOfTheOthers) {
  Random random(9);
  constexpr Eigen::Index kRank = 6;
  constexpr Eigen::Index kCount = 9;
  Eigen::MatrixXd R = Eigen::MatrixXd::NullaryExpr(kCount, kCount, [&] { return random.normal(); });
  R = R.triangularView<Eigen::Upper>().toDenseMatrix();
  R.diagonal().setConstant(5);
  R.bottomRightCorner(kCount - kRank, kCount - kRank).setZero();
  EXPECT_TRUE(parts_clearly(R, kRank, {}));
  EXPECT_FALSE(parts_clearly(R, kRank - 1, {})) << "a column of the others shows";
  EXPECT_FALSE(parts_clearly(R, kRank + 1, {})) << "one of the first shows nothing";
  EXPECT_FALSE(parts_clearly(R, 0, {}));
  GaugeOptions off;
  off.off = true;
  EXPECT_FALSE(parts_clearly(R, kRank, off)) << "all are free without a gauge";
  Eigen::MatrixXd faint = R;
  faint(kCount - 1, kCount - 1) = 1e-9;
  EXPECT_FALSE(parts_clearly(faint, kRank, {})) << "so little that it might count";
  Eigen::MatrixXd weak = R;
  weak(2, 2) = 0.05;
  EXPECT_FALSE(parts_clearly(weak, kRank, {})) << "fixed to no better than 20 plausible sizes";
  weak(2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(parts_clearly(weak, kRank, {}));
}

/// What a gauge holds of two directions at right angles to (x, y, z), which nothing shows.
std::vector<int> held_beside(const Eigen::Vector3d& unseen, const Eigen::Vector3d& hold) {
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - unseen * unseen.transpose() / unseen.squaredNorm();
  return choose_gauge(1e3 * across, hold).held;
}

TEST(Gauge, WhatWouldRunAwayBesideAHeldParameterIsHeldInItsStead) {
  const Eigen::Vector3d rod_base_tool(1, 2e-5, 1e-3);  // fixing_priority()
  EXPECT_EQ(held_beside({2e-3, 0.7, -0.7}, rod_base_tool), std::vector<int>{2}) << "350 of the tool by 1 of the rod";
  EXPECT_EQ(held_beside({2e-2, 0.7, -0.7}, rod_base_tool), std::vector<int>{0}) << "35: the priority counts";
  EXPECT_EQ(held_beside({2e-3, 1.0, 0.0}, rod_base_tool), std::vector<int>{0}) << "where the base is, nobody knows";
}

TEST(Gauge, NothingAskedOrNothingSeenIsNoCrash) {
  const Gauge none = choose_gauge(Eigen::MatrixXd(0, 0), Eigen::VectorXd(0));
  EXPECT_EQ(none.rank, 0);
  EXPECT_TRUE(none.free.empty() && none.held.empty());
  const Gauge blind = choose_gauge(Eigen::MatrixXd::Zero(3, 3), Eigen::Vector3d::Ones());
  EXPECT_EQ(blind.rank, 0);
  EXPECT_EQ(blind.held.size(), 3U);
  EXPECT_TRUE(blind.directions.allFinite());
}

}  // namespace
}  // namespace fastcal
