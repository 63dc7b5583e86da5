// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/measurements.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

using test::Random;

const double kNan = std::nan("");

RobotModel arm() { return test::build("dh", test::six_axes()); }

/// Two cameras, of which one is on the flange, and two boards, of which one is: six corners each.
Rig rig(bool identified = true) {
  Random random(3);
  Rig out;
  Intrinsics brown = Intrinsics::Zero(), kannala = Intrinsics::Zero();
  brown << 1400, 1402, 640, 512, -0.11, 0.09, 2e-4, -3e-4, 0.01, 0.02, -0.01, 0.005;
  kannala.head<8>() << 700, 702, 640, 512, 0.02, -0.01, 0.003, -0.001;
  out.cameras.push_back({{"wrist", link_frame(5), random.pose(0.1), false}, LensModel::kPinhole, brown, 0});
  out.cameras.push_back({{"room", kWorldFrame, random.pose(1), false}, LensModel::kFisheye, kannala, 0});
  if (identified) {
    out.cameras[0].identified_intrinsics = 12;
    out.cameras[1].identified_intrinsics = 8;
  }
  Eigen::Matrix3Xd corners(3, 6);
  for (int k = 0; k < 6; ++k) corners.col(k) << 0.02 * (k % 3), 0.03 * (k / 3), 0;
  out.boards.push_back({{"plate", kWorldFrame, random.pose(1), false}, corners});
  out.boards.push_back({{"tag", link_frame(5), random.pose(0.1), false}, corners});
  return out;
}

/// Rows in which every camera sees every board, at the given pictures.
Measurements measured(const Rig& of, const RowMatrixXd& uv) {
  Tables tables{uv.rows(), {{"corner", uv}}, {}, of};
  return {tables, arm()};
}

Comparison compared(const Measurements& all, const Sights& sights, const Eigen::VectorXd& unknowns, int reading,
                    Eigen::Index row = 0) {
  Comparison out;
  out.clear();
  all.observations()[0]->compare_reading(row, reading, sights, unknowns.data(), out);
  return out;
}

/// d r / d unknown k, wherever it is among the derivatives.
Eigen::Vector2d by_unknown(const Comparison& of, int k) {
  const int first = k - of.first_unknown, second = k - of.second_unknown;
  if (first >= 0 && first < of.unknown_count) return of.by_unknown.col(first).head<2>();
  if (second >= 0 && second < of.second_count) return of.by_unknown.col(of.unknown_count + second).head<2>();
  return Eigen::Vector2d::Zero();
}

TEST(Corner, DerivativesAreThoseOfTheResidual) {
  constexpr double h = 1e-4;
  Random random(7);
  Rig moving = rig();
  Random twists(13);
  moving.cameras[0].delay = 0.02;
  for (Standing* standing : std::initializer_list<Standing*>{&moving.cameras[0], &moving.boards[1]}) {
    standing->motion = twists.values(6, 0.3).transpose();
    standing->shift = twists.values(6, 0.01).transpose();
  }
  const Measurements all = measured(moving, RowMatrixXd::Constant(1, 48, 500));
  const PlacedObservation& of = all.observations()[0];
  ASSERT_EQ(of.component_count, 48);
  ASSERT_EQ(of.unknown_count, 6 + 12 + 6 + 8 + 6 + 6);
  const Eigen::VectorXd unknowns = random.values(of.unknown_count, 0.05);
  const auto slope = [&](const std::function<Eigen::Vector3d(double)>& r) -> Eigen::Vector2d {
    return ((8 * (r(h) - r(-h)) - (r(2 * h) - r(-2 * h))) / (12 * h)).head<2>();
  };
  int tried = 0;
  for (int reading = 0; reading < 24; ++reading) {
    Sights sights{random.pose(1), random.pose(1)};
    Comparison here = compared(all, sights, unknowns, reading);
    // Only what lies well before the camera: near its plane differences say nothing.
    for (int k = 0; k < 400 && here.r.norm() > 4000; ++k) {
      sights = {random.pose(1), random.pose(1)};
      here = compared(all, sights, unknowns, reading);
    }
    if (here.r.norm() > 4000) continue;
    ++tried;
    const double size = here.by_frame[0].cwiseAbs().maxCoeff() + 1e3;
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector2d wanted = slope([&](double step) {
        Sights there = sights;
        if (k < 3) there[0].p[k] += step;
        if (k >= 3) there[0].R = exp_so3(step * Eigen::Vector3d::Unit(k - 3)) * there[0].R;
        return compared(all, there, unknowns, reading).r;
      });
      EXPECT_LT((here.by_frame[0].col(k).head<2>() - wanted).norm(), 1e-6 * size) << reading << " by frame, " << k;
    }
    for (int k = 0; k < of.unknown_count; ++k) {
      const Eigen::Vector2d wanted = slope([&](double step) {
        Eigen::VectorXd there = unknowns;
        there[k] += step;
        return compared(all, sights, there, reading).r;
      });
      EXPECT_LT((by_unknown(here, k) - wanted).norm(), 1e-6 * size) << reading << " by " << of->parameters()[k].name;
    }
  }
  EXPECT_GT(tried, 6);
}

TEST(Corner, AFrameThatMovesOrIsOutOfPlaceIsWhereItsTwistsPutIt) {
  Random random(11);
  Rig moving = rig(false), still = rig(false);
  const Vector6d motion = random.values(6, 0.3), shift = random.values(6, 0.01);
  moving.cameras[0].delay = 0.02;
  moving.cameras[0].line_time = 1e-4;
  moving.cameras[0].middle_line = 100;
  moving.cameras[0].motion = motion.transpose();
  moving.cameras[0].shift = shift.transpose();
  moving.boards[0].shift = -shift.transpose();
  const double seconds = 0.02 + 1e-4 * (500 - 100);
  const RowMatrixXd uv = RowMatrixXd::Constant(1, 48, 500);
  const Measurements late = measured(moving, uv), there = measured(still, uv);
  const Eigen::VectorXd unknowns = random.values(late.unknown_count(), 0.01);
  Sights sights{random.pose(1), random.pose(1)};
  const Pose moved = sights[0] * exp_se3(seconds * motion) * exp_se3(shift);
  // The board stands in the measuring frame: it is out of place there, which moves all else the other way.
  const Pose back = exp_se3(shift);
  const Sights instead{back * moved, sights[1]};
  for (int reading = 0; reading < 6; ++reading) {
    const Comparison got = compared(late, sights, unknowns, reading);
    const Comparison wanted = compared(there, instead, unknowns, reading);
    EXPECT_LT((got.r - wanted.r).norm(), 1e-8 * (1 + wanted.r.norm())) << reading;
    for (int k = 0; k < 6; ++k) {
      EXPECT_LT((by_unknown(got, k) - by_unknown(wanted, k)).norm(), 1e-6 * (1 + by_unknown(wanted, k).norm())) << k;
    }
  }
}

/// With a rolling shutter each corner has its own moment.
TEST(Corner, AllReadingsOfARowAreThoseOfEach) {
  Random random(17);
  Rig moving = rig();
  moving.cameras[0].delay = 0.02;
  moving.cameras[0].line_time = 1e-4;
  moving.cameras[0].motion = random.values(12, 0.3).reshaped(2, 6);
  moving.boards[1].shift = random.values(12, 0.01).reshaped(2, 6);
  RowMatrixXd uv = RowMatrixXd::NullaryExpr(2, 48, [&] { return random.uniform(0, 1000); });
  uv(1, 4) = uv(1, 13) = kNan;
  const Measurements all = measured(moving, uv);
  const Measurements second = all.pick({1});
  const Sights sights{random.pose(1), random.pose(1)};
  const Eigen::VectorXd unknowns = random.values(all.unknown_count(), 0.05);
  std::vector<int> taken;
  Comparison found;
  found.clear();
  second.observations()[0]->compare_all(0, sights, unknowns.data(), found, [&](int reading) {
    const Comparison wanted = compared(all, sights, unknowns, reading, 1);
    EXPECT_EQ(found.r, wanted.r) << reading;
    EXPECT_EQ(found.by_frame[0], wanted.by_frame[0]) << reading;
    EXPECT_EQ(found.by_unknown, wanted.by_unknown) << reading;
    EXPECT_EQ(found.first_unknown, wanted.first_unknown) << reading;
    EXPECT_EQ(found.second_unknown, wanted.second_unknown) << reading;
    taken.push_back(reading);
    found.clear();
  });
  EXPECT_EQ(taken.size(), 22U);
  EXPECT_EQ(std::count(taken.begin(), taken.end(), 2) + std::count(taken.begin(), taken.end(), 6), 0);
}

TEST(Corner, TwistsOfAnotherNumberOfRowsAreRefused) {
  Rig wrong = rig(false);
  wrong.boards[0].motion = RowMatrixXd::Zero(2, 6);
  EXPECT_THROW(measured(wrong, RowMatrixXd::Constant(1, 48, 500)), InvalidInput);
}

TEST(Corner, WhatNobodySawIsAbsentAndHasNoUnknowns) {
  RowMatrixXd uv = RowMatrixXd::Constant(2, 48, kNan);
  uv.block(0, 0, 1, 12).setConstant(500);  // the wrist sees the plate in the first row
  const Measurements all = measured(rig(false), uv);
  ASSERT_EQ(all.unknown_count(), 12);
  EXPECT_EQ(all.parameters()[0].owner, "camera wrist");
  EXPECT_EQ(all.parameters()[6].owner, "board plate");
  const Sights sights{};
  EXPECT_TRUE(compared(all, sights, Eigen::VectorXd::Zero(12), 0).present[0]);
  EXPECT_FALSE(compared(all, sights, Eigen::VectorXd::Zero(12), 0, 1).present[0]);
  EXPECT_FALSE(compared(all, sights, Eigen::VectorXd::Zero(12), 20).present[0]);
}

/// Both cameras and both boards from pictures without noise, wherever the file has them.
TEST(Corner, ItsStartIsExactOnExactPictures) {
  constexpr int kRows = 20;
  Random random(5);
  Rig truth = rig(false);
  truth.cameras[1].lens = LensModel::kPinhole;
  truth.cameras[1].intrinsics = truth.cameras[0].intrinsics;
  Rig given = truth;
  for (Camera& camera : given.cameras) camera.T_frame_own = random.pose(0.5);
  for (Board& board : given.boards) board.T_frame_own = random.pose(0.5);
  RowMatrixXd uv = RowMatrixXd::Constant(2 * kRows, 48, kNan);
  std::vector<Sights> sights;
  const auto before = [&] {
    const Eigen::Matrix3d R = exp_so3(0.5 * random.unit()) * exp_so3(Eigen::Vector3d(M_PI, 0, 0));
    return Pose{R, {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(0.5, 0.7)}};
  };
  for (int i = 0; i < 2 * kRows; ++i) {
    // The wrist sees the plate, then the camera in the room sees the tag on the flange.
    const Camera& camera = truth.cameras[i < kRows ? 0 : 1];
    const Board& board = truth.boards[i < kRows ? 0 : 1];
    const Pose T_camera_board = before();
    const Pose flange = i < kRows ? board.T_frame_own * T_camera_board.inverse() * camera.T_frame_own.inverse()
                                  : camera.T_frame_own * T_camera_board * board.T_frame_own.inverse();
    sights.push_back({flange, Pose{}});
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d point = T_camera_board * board.corners.col(k).eval();
      uv.row(i).segment<2>(2 * ((i < kRows ? 0 : 18) + k)) = draw(camera.lens, camera.intrinsics, point).uv.transpose();
    }
  }
  const Measurements all = measured(given, uv);
  Eigen::VectorXd start(all.unknown_count());
  ASSERT_EQ(all.observations()[0]->start(sights, start), "");
  for (int i = 0; i < 2 * kRows; ++i) {
    for (int k = 0; k < 6; ++k)
      EXPECT_LT(compared(all, sights[static_cast<std::size_t>(i)], start, (i < kRows ? 0 : 18) + k, i).r.norm(), 1e-4);
  }
}

TEST(Corner, SaysWhatIsMissing) {
  RowMatrixXd uv = RowMatrixXd::Constant(2, 48, kNan);
  uv.block(0, 0, 2, 12) = RowMatrixXd::NullaryExpr(
      2, 12, [](Eigen::Index, Eigen::Index k) { return 300.0 + 31.0 * static_cast<double>(k * k); });
  const Measurements all = measured(rig(false), uv);
  Eigen::VectorXd start(all.unknown_count());
  const std::string missing = all.observations()[0]->start(std::vector<Sights>(2), start);
  EXPECT_EQ(missing.substr(0, 72), "camera wrist and board plate need at least three pictures with four corn");
}

TEST(Corner, NeedsAPositiveSigmaWhereItWasSeen) {
  Tables tables{1, {{"corner", RowMatrixXd::Constant(1, 48, 500)}}, {}, rig()};
  tables.numbers["sigma_corner"] = RowMatrixXd::Constant(1, 24, 0.1);
  const Measurements all(tables, arm());
  EXPECT_TRUE(all.claims_sigma());
  EXPECT_EQ(all.sigma(0, 47), 0.1);
  tables.numbers["sigma_corner"](0, 5) = 0;
  EXPECT_THROW(Measurements(tables, arm()), InvalidInput);
}

}  // namespace
}  // namespace fastcal
