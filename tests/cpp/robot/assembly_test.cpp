// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Closed loops by themselves: all equations hold at random postures, their derivatives against differences by joints
// and by constants, the way of assembly stays that of the start, and what cannot close or may move by itself is said.
#include "fastcal/robot/assembly.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "fastcal/math/check.hpp"
#include "support/loops.hpp"

namespace fastcal {
namespace {

using test::Random;

struct Case {
  const char* name;
  RobotModel robot;
};

std::vector<Case> robots() {
  return {{"five-bar", test::five_bar()},
          {"four-bar, hinge", test::four_bar({0, 1, 2, 3, 4})},
          {"four-bar, weld", test::four_bar({0, 1, 2, 3, 4, 5})},
          {"four-bar, ball", test::four_bar({0, 1, 2})},
          {"palletizer", test::palletizer()},
          {"hexapod", test::hexapod()}};
}

/// The motors of `home` moved by up to `spread` [rad], a tenth of it [m].
std::vector<double> posture(const Chain& chain, Random& random, double spread) {
  std::vector<double> q(chain.home.data(), chain.home.data() + chain.joint_count());
  for (std::size_t j = 0; j < q.size(); ++j) {
    const double size = chain.joint_types[j] == JointType::kPrismatic ? 0.1 * spread : spread;
    if (std::find(chain.passive.begin(), chain.passive.end(), static_cast<int>(j)) == chain.passive.end())
      q[j] += random.uniform(-size, size);
  }
  return q;
}

double largest(const Chain& chain, const double* q) {
  std::vector<Pose> frames;
  forward(chain, q, nullptr, frames);
  double out = 0;
  for (const LoopRow& row : loop_rows(chain, frames, q, nullptr, true)) out = std::max(out, std::abs(row.value));
  return out;
}

TEST(Assembly, EveryEquationHoldsAtRandomPosturesThoseThatAreNotKeptToo) {
  for (const Case& each : robots()) {
    Random random(3);
    const Chain chain = each.robot.chain();
    ASSERT_EQ(chain.loop_rows.size(), chain.passive.size()) << each.name;
    Assembler assembler(chain);
    for (int trial = 0; trial < test::repeat(200); ++trial) {
      std::vector<double> q = posture(chain, random, 0.3);
      ASSERT_EQ(assembler.assemble(q.data()), AssemblyStatus::kClosed) << each.name;
      ASSERT_LT(assembler.gap(), 1e-10) << each.name;
      ASSERT_LT(largest(chain, q.data()), 1e-10) << each.name;
    }
  }
}

/// Fourth-order differences of all equations of all loops.
Eigen::VectorXd slope(const std::function<Eigen::VectorXd(double)>& values) {
  constexpr double h = 1e-3;
  return (8 * (values(h) - values(-h)) - (values(2 * h) - values(-2 * h))) / (12 * h);
}

Eigen::VectorXd values_of(const Chain& chain, const std::vector<double>& q) {
  std::vector<Pose> frames;
  forward(chain, q.data(), nullptr, frames);
  const std::vector<LoopRow> rows = loop_rows(chain, frames, q.data(), nullptr, true);
  Eigen::VectorXd out(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t r = 0; r < rows.size(); ++r) out[static_cast<Eigen::Index>(r)] = rows[r].value;
  return out;
}

TEST(Assembly, DerivativesByJointsAreThoseOfDifferencesAlsoWhereTheLoopIsOpen) {
  for (const Case& each : robots()) {
    Random random(4);
    const Chain chain = each.robot.chain();
    for (int trial = 0; trial < test::repeat(50); ++trial) {
      std::vector<double> q(static_cast<std::size_t>(chain.joint_count()));
      for (std::size_t j = 0; j < q.size(); ++j)
        q[j] = chain.home[static_cast<Eigen::Index>(j)] + random.uniform(-0.1, 0.1);
      std::vector<Pose> frames;
      forward(chain, q.data(), nullptr, frames);
      const std::vector<LoopRow> rows = loop_rows(chain, frames, q.data(), nullptr, true);
      for (int joint = 0; joint < chain.joint_count(); ++joint) {
        const Eigen::VectorXd wanted = slope([&](double step) {
          std::vector<double> there = q;
          there[static_cast<std::size_t>(joint)] += step;
          return values_of(chain, there);
        });
        for (std::size_t r = 0; r < rows.size(); ++r)
          ASSERT_NEAR(by_joint(chain, rows[r], frames, joint, nullptr), wanted[static_cast<Eigen::Index>(r)], 1e-9)
              << each.name << " joint " << joint << " equation " << r;
      }
    }
  }
}

TEST(Assembly, DerivativesByTheLoopsOwnConstantsAreThoseOfDifferences) {
  for (const Case& each : robots()) {
    Random random(5);
    const Chain chain = each.robot.chain();
    Eigen::VectorXd theta = each.robot.nominal();
    for (int trial = 0; trial < test::repeat(20); ++trial) {
      const std::vector<double> q = posture(chain, random, 0.1);
      std::vector<Pose> frames;
      forward(chain, q.data(), nullptr, frames);
      const std::vector<LoopRow> rows = loop_rows(chain, frames, q.data(), nullptr, true);
      int seen = 0;
      for (int k = 0; k < theta.size(); ++k) {
        const Parameter& parameter = each.robot.parameters()[static_cast<std::size_t>(k)];
        if (parameter.owner.starts_with("joint") || parameter.owner == "base" || parameter.owner == "tool") continue;
        const Eigen::VectorXd wanted = slope([&](double step) {
          Eigen::VectorXd there = theta;
          there[k] += step;
          return values_of(each.robot.chain(there), q);
        });
        for (std::size_t r = 0; r < rows.size(); ++r) {
          double found = 0;
          for (const auto& [at, by] : rows[r].by_parameter) found += at == k ? by : 0.0;
          ASSERT_NEAR(found, wanted[static_cast<Eigen::Index>(r)], 1e-9) << each.name << " " << parameter.label();
        }
        ++seen;
      }
      ASSERT_GT(seen, 1) << each.name;
      ASSERT_TRUE(each.robot.chain(theta).loop_rows == chain.loop_rows);
    }
  }
}

/// The elbow of a five-bar is where two circles meet: on the side of the start, whatever the passive joint says.
TEST(Assembly, TheWayOfAssemblyIsThatOfTheStart) {
  for (const double side : {1.0, -1.0}) {
    const RobotModel robot = test::five_bar(side);
    const Chain chain = robot.chain();
    Random random(6);
    Assembler assembler(chain);
    for (int trial = 0; trial < test::repeat(200); ++trial) {
      std::vector<double> q = posture(chain, random, 0.5);
      q[2] = random.uniform(-3, 3);
      ASSERT_EQ(assembler.assemble(q.data()), AssemblyStatus::kClosed);
      const Eigen::Vector3d left(-0.1 + 0.2 * std::cos(q[0]), 0.2 * std::sin(q[0]), 0);
      const Eigen::Vector3d right(0.1 + 0.2 * std::cos(q[1]), 0.2 * std::sin(q[1]), 0);
      const Eigen::Vector3d half = (right - left) / 2;
      const Eigen::Vector3d up = Eigen::Vector3d::UnitZ().cross(half).normalized();
      const Eigen::Vector3d wanted = left + half + side * up * std::sqrt(0.32 * 0.32 - half.squaredNorm());
      const Eigen::Vector3d found = assembler.frames()[static_cast<std::size_t>(robot.view().target)].p;
      ASSERT_LT((found - wanted).norm(), 1e-10);
    }
  }
}

TEST(Assembly, WhatCannotCloseIsOpenAndWhereTheGapIsLeast) {
  const RobotModel robot = test::five_bar();
  Chain chain = robot.chain();
  const auto at = [&](double length, double& gap) {  // 600 mm between the cranks' ends
    std::vector<double> q{test::kPi, 0, 1};
    chain.loops.front().length = length;
    Assembler assembler(chain);
    const AssemblyStatus status = assembler.assemble(q.data());
    gap = assembler.gap();
    return status;
  };
  double gap = 0;
  EXPECT_EQ(at(0.32, gap), AssemblyStatus::kClosed);
  EXPECT_LT(gap, 1e-10);
  EXPECT_EQ(at(0.25, gap), AssemblyStatus::kOpen);
  EXPECT_NEAR(gap, 0.6 - 0.32 - 0.25, 1e-6);
}

/// A parallelogram laid flat may go on as a parallelogram or as its crossed form: its passive joints may move.
TEST(Assembly, AFlatParallelogramIsSingular) {
  const RobotModel robot = test::four_bar({0, 1, 2});
  const Chain chain = robot.chain();
  Assembler assembler(chain);
  std::vector<double> q(chain.home.data(), chain.home.data() + chain.joint_count());
  EXPECT_EQ(assembler.assemble(q.data()), AssemblyStatus::kClosed);
  q[0] = 0;
  EXPECT_EQ(assembler.assemble(q.data()), AssemblyStatus::kSingular);
}

/// Beyond the fold its crossed form closes too, and lies on the same side: the way there is seen to bend.
TEST(Assembly, BeyondItsFoldAParallelogramIsAnotherAssembly) {
  const RobotModel robot = test::four_bar({0, 1, 2});
  const Chain chain = robot.chain();
  for (const double beyond : {-0.05, -0.3, -0.9}) {
    Assembler assembler(chain);
    std::vector<double> q(chain.home.data(), chain.home.data() + chain.joint_count());
    q[0] = beyond;
    EXPECT_NE(assembler.assemble(q.data()), AssemblyStatus::kClosed) << beyond;
  }
}

TEST(Assembly, ALoopThatLeavesAJointFreeOrCannotCloseIsRefused) {
  const auto refusal = [](const std::function<void()>& build) -> std::string {
    try {
      build();
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  EXPECT_NE(refusal([] { test::four_bar({0}); }).find("1 independent equations for 2 passive joints"),
            std::string::npos);
  EXPECT_NE(refusal([] { test::five_bar(1, 0.01); }).find("do not close at the start posture: 'rod' lacks"),
            std::string::npos);
}

}  // namespace
}  // namespace fastcal
