// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/measurements.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "fastcal/math/check.hpp"
#include "support/random.hpp"

namespace fastcal {
namespace {

using test::Random;

const double kNan = std::nan("");

Eigen::Vector4d wxyz(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return {q.w(), q.x(), q.y(), q.z()};
}

/// One row with everything measured, at `T` but for the errors given.
Measurements measured_at(const Pose& T, const Eigen::Vector3d& dp, const Eigen::Vector3d& turn,
                         const Eigen::Vector3d& anchor, double stretch) {
  Measurements m;
  m.position = (T.p - dp).transpose();
  m.rotation = wxyz(T.R * exp_so3(-turn)).transpose();
  m.distance = Eigen::VectorXd::Constant(1, (T.p - anchor).norm() - stretch);
  m.anchor = Eigen::VectorXi::Zero(1);
  m.anchor_count = 1;
  return m;
}

TEST(Residual, IsPredictedLessMeasured) {
  Random random(1);
  for (int k = 0; k < 200; ++k) {
    const Pose T = random.pose(2);
    const Eigen::Vector3d dp = random.vector(0.1);
    const Eigen::Vector3d turn = random.uniform(0, 3.1) * random.unit();
    const Eigen::Matrix3Xd anchors = random.vector(5);
    RowResidual row;
    row_residual(measured_at(T, dp, turn, anchors, 0.02), 0, T, &anchors, row);
    EXPECT_LT((row.r.head<3>() - dp).norm(), 1e-14);
    EXPECT_LT((row.r.segment<3>(3) - turn).norm(), 1e-13);
    EXPECT_NEAR(row.r[6], 0.02, 1e-14);
    for (const bool present : row.present) EXPECT_TRUE(present);
  }
}

TEST(Residual, JacobianIsTheDerivativeByTheToolsMotion) {
  Random random(2);
  constexpr double h = 1e-3;
  for (int k = 0; k < 100; ++k) {
    const Pose T = random.pose(2);
    const Eigen::Vector3d turn = random.uniform(0, 2.5) * random.unit();
    Eigen::Matrix3Xd anchors = random.vector(5);
    const Measurements m = measured_at(T, random.vector(0.1), turn, anchors, 0.02);
    RowResidual row;
    row_residual(m, 0, T, &anchors, row);
    const auto stencil = [&](const auto& at) {
      const auto r = [&](double step) {
        RowResidual moved;
        at(step, moved);
        return moved.r;
      };
      return ((8 * (r(h) - r(-h)) - (r(2 * h) - r(-2 * h))) / (12 * h)).eval();
    };
    for (int j = 0; j < 6; ++j) {
      const auto column = stencil([&](double step, RowResidual& moved) {
        Pose there = T;
        if (j < 3) there.p[j] += step;
        if (j >= 3) there.R = exp_so3(step * Eigen::Vector3d::Unit(j - 3)) * T.R;
        row_residual(m, 0, there, &anchors, moved);
      });
      EXPECT_LT((row.J_r_tool.col(j) - column).norm(), 1e-8) << "turned by " << turn.norm() << ", column " << j;
    }
    for (int j = 0; j < 3; ++j) {
      const auto column = stencil([&](double step, RowResidual& moved) {
        Eigen::Matrix3Xd there = anchors;
        there(j, 0) += step;
        row_residual(m, 0, T, &there, moved);
      });
      EXPECT_NEAR(row.J_distance_anchor[j], column[6], 1e-8);
    }
  }
}

TEST(Residual, WhatWasNotMeasuredIsAbsentAndLeavesZeros) {
  const Pose T = Random(3).pose(2);
  const Eigen::Matrix3Xd anchors = Eigen::Vector3d(1, 2, 3);
  Measurements m = measured_at(T, {1, 2, 3}, {0.1, 0, 0}, anchors, 0.1);
  m.position(0, 1) = kNan;
  m.rotation(0, 2) = kNan;
  m.distance[0] = kNan;
  RowResidual row;
  row_residual(measured_at(T, {1, 2, 3}, {0.1, 0, 0}, anchors, 0.1), 0, T, &anchors, row);
  row_residual(m, 0, T, &anchors, row);  // the same object again: nothing of the row before may stay
  EXPECT_EQ(row.present, (std::array<bool, 7>{true, false, true, false, false, false, false}));
  EXPECT_EQ(row.r[1], 0);
  EXPECT_EQ(row.r.tail<4>().norm(), 0);
  EXPECT_EQ(row.J_r_tool.row(1).norm(), 0);
  EXPECT_EQ(row.J_r_tool.bottomRows<4>().norm(), 0);
  EXPECT_EQ(row.anchor, -1);
}

TEST(Residual, AToolInItsAnchorHasAFiniteDerivative) {
  const Pose T = Random(4).pose(2);
  const Eigen::Matrix3Xd anchors = T.p;
  RowResidual row;
  row_residual(measured_at(T, {0, 0, 0}, {0, 0, 0}, anchors, -0.3), 0, T, &anchors, row);
  EXPECT_NEAR(row.r[6], -0.3, 1e-15);
  EXPECT_TRUE(row.J_r_tool.allFinite());
  EXPECT_NEAR(row.J_r_tool.row(6).norm(), 1, 1e-15);
}

TEST(Measurements, SigmaOfADistanceIsThatOfTheFirstCoordinate) {
  Measurements m = measured_at(Pose(), {0, 0, 0}, {0, 0, 0}, {1, 0, 0}, 0);
  EXPECT_EQ(m.sigma(0, 0), 0);
  m.sigma_position.resize(1, 3);
  m.sigma_position << 1, 2, 3;
  m.sigma_rotation = Eigen::VectorXd::Constant(1, 4);
  const std::array<double, 7> wanted{1, 2, 3, 4, 4, 4, 1};
  for (int c = 0; c < kComponents; ++c) EXPECT_EQ(m.sigma(0, c), wanted[static_cast<std::size_t>(c)]);
}

TEST(Measurements, BadTablesAreRefusedInASentence) {
  const auto refusal = [](const std::function<void(Measurements&)>& spoil, Eigen::Index rows = 1) -> std::string {
    Measurements m = measured_at(Pose(), {0, 0, 0}, {0, 0, 0}, {1, 0, 0}, 0);
    m.sigma_position = RowMatrixXd::Constant(1, 3, 1e-4);
    m.sigma_rotation = Eigen::VectorXd::Constant(1, 1e-4);
    spoil(m);
    try {
      m.check(rows);
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal([](Measurements&) {}), "nothing was refused");
  EXPECT_EQ(refusal([](Measurements& m) { m.position.setConstant(kNan); }), "nothing was refused");
  EXPECT_EQ(refusal([](Measurements&) {}, 2), "position must have 2 rows and 3 columns, got 1 and 3");
  EXPECT_EQ(refusal([&](Measurements& m) { m.position(0, 2) = inf; }),
            "position must be finite, or NaN where it was not measured");
  EXPECT_EQ(refusal([](Measurements& m) { m.rotation *= 2; }), "row 0: a quaternion must have length 1, got 2");
  EXPECT_EQ(refusal([](Measurements& m) { m.distance[0] = -1; }),
            "distance must be finite and not negative, or NaN where it was not measured");
  EXPECT_EQ(refusal([](Measurements& m) { m.anchor[0] = 1; }), "row 0: anchor must be 0 to 0, got 1");
  EXPECT_EQ(refusal([](Measurements& m) { m.anchor.resize(0); }), "distances need an anchor in every row");
  EXPECT_EQ(refusal([](Measurements& m) { m.sigma_position(0, 1) = 0; }), "sigma_position must be positive and finite");
  EXPECT_EQ(refusal([](Measurements& m) { m.sigma_position(0, 1) = kNan; }),
            "sigma_position must be positive and finite");
  EXPECT_EQ(refusal([&](Measurements& m) { m.sigma_rotation[0] = inf; }), "sigma_rotation must be positive and finite");
  EXPECT_EQ(refusal([](Measurements& m) {
              m.position.resize(0, 3);
              m.rotation.resize(0, 4);
              m.distance.resize(0);
            }),
            "nothing was measured: position, rotation and distance are all missing");
}

}  // namespace
}  // namespace fastcal
