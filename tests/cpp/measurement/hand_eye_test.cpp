// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/hand_eye.hpp"

#include <gtest/gtest.h>

#include "fastcal/math/se3.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

using test::Random;

Eigen::Matrix3Xd checkerboard() {
  Eigen::Matrix3Xd out(3, 12);
  for (int k = 0; k < 12; ++k) out.col(k) << 0.02 * (k % 4), 0.02 * (k / 4), 0;
  return out;
}

/// A board half a metre before the camera, turned by up to 0.6 rad about any axis but half a turn about its normal.
Pose before_camera(Random& random) {
  const Eigen::Matrix3d R = exp_so3(0.6 * random.unit()) * exp_so3(Eigen::Vector3d(M_PI, 0, 0));
  return {R, Eigen::Vector3d(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(0.4, 0.6))};
}

Eigen::Matrix2Xd seen(const Pose& T_camera_board, const Eigen::Matrix3Xd& points) {
  Eigen::Matrix2Xd out(2, points.cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) out.col(k) = (T_camera_board * points.col(k).eval()).hnormalized();
  return out;
}

double apart(const Pose& a, const Pose& b) { return (a.p - b.p).norm() + (a.R - b.R).norm(); }

TEST(PoseFromPoints, OfABoardIsExact) {
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const Pose truth = before_camera(random);
    const auto found = pose_from_points(checkerboard(), seen(truth, checkerboard()));
    ASSERT_TRUE(found);
    EXPECT_LT(apart(*found, truth), 1e-9);
  }
}

TEST(PoseFromPoints, OfPointsInSpaceIsExact) {
  Random random(2);
  Eigen::Matrix3Xd points(3, 9);
  for (int k = 0; k < 9; ++k) points.col(k) = 0.1 * random.unit();
  const Pose truth = before_camera(random);
  const auto found = pose_from_points(points, seen(truth, points));
  ASSERT_TRUE(found);
  EXPECT_LT(apart(*found, truth), 1e-9);
}

TEST(PoseFromPoints, OfThreePointsOrALineThereIsNone) {
  Random random(3);
  const Pose truth = before_camera(random);
  const Eigen::Matrix3Xd three = checkerboard().leftCols<3>(), line = checkerboard().leftCols<4>();
  EXPECT_FALSE(pose_from_points(three, seen(truth, three)));
  EXPECT_FALSE(pose_from_points(line, seen(truth, line)));
}

struct Scene {
  Pose X, Y;
  std::vector<Picture> pictures;
};

Scene scene(std::uint64_t seed, int count) {
  Random random(static_cast<unsigned>(seed));
  Scene out{random.pose(0.1), random.pose(1), {}};
  for (int k = 0; k < count; ++k) {
    const Pose T_camera_board = before_camera(random);
    out.pictures.push_back({out.Y * T_camera_board.inverse() * out.X.inverse(), T_camera_board});
  }
  return out;
}

TEST(HandEye, IsExactOnExactPictures) {
  for (int seed = 1; seed < 10; ++seed) {
    const Scene of = scene(static_cast<std::uint64_t>(seed), 12);
    const auto found = hand_eye(of.pictures);
    ASSERT_TRUE(found);
    EXPECT_LT(apart(found->T_a_camera, of.X), 1e-8);
    EXPECT_LT(apart(found->T_b_board, of.Y), 1e-8);
  }
}

/// A third of the boards read from their other end, which is no noise: every such picture says the same wrong thing.
TEST(HandEye, DoesNotMindAThirdOfThePicturesReadFromTheOtherEnd) {
  Scene of = scene(11, 30);
  const Pose other_end{exp_so3(Eigen::Vector3d(0, 0, M_PI)), Eigen::Vector3d(0.06, 0.04, 0)};
  for (std::size_t k = 0; k < 10; ++k)
    of.pictures[3 * k].T_camera_board = of.pictures[3 * k].T_camera_board * other_end;
  const auto found = hand_eye(of.pictures);
  ASSERT_TRUE(found);
  EXPECT_LT(apart(found->T_a_camera, of.X) + apart(found->T_b_board, of.Y), 1e-8);
}

TEST(HandEye, NeedsThreePictures) { EXPECT_FALSE(hand_eye(scene(5, 2).pictures)); }

TEST(TypicalPose, IsThatOfTheMany) {
  Random random(4);
  const Pose truth = random.pose(1);
  std::vector<Pose> poses(7, truth);
  for (int k = 0; k < 3; ++k) poses.push_back(random.pose(1));
  EXPECT_LT(apart(typical_pose(poses), truth), 1e-12);
}

}  // namespace
}  // namespace fastcal
