// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Closed forms for cameras and boards, without a guess: a board's pose from one picture, then where camera and board
// are from many.
#pragma once

#include <optional>
#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// Pose of a board in the camera's frame from its points (3, K) [m] and the directions (x, y, 1) in which they are
/// seen: a homography where they lie in a plane (four at least), else a direct linear transformation (six), refined by
/// least squares. None where they do not fix it. Source: R. Hartley, A. Zisserman, "Multiple View Geometry" (2004), 4.1
/// and 7.1.
std::optional<Pose> pose_from_points(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& directions);

/// What one picture says of T_a_camera = X and T_b_board = Y: D X C = Y, D = T_b_a by the arm, C = T_camera_board.
struct Picture {
  Pose T_b_a, T_camera_board;
};

/// X and Y of many pictures.
struct HandEye {
  Pose T_a_camera, T_b_board;
};

/// X and Y with the least median misfit: the closed form of M. Shah (2013), vec X and vec Y being the singular vectors
/// of sum C^T (x) D, on subsets of the pictures that shrink to those that agree (P. Rousseeuw, K. Van Driessen 1999);
/// always the same ones. None where fewer than three pictures are there.
std::optional<HandEye> hand_eye(const std::vector<Picture>& pictures);

/// The pose with the least median distance from the others, then the mean of those that are near it.
Pose typical_pose(const std::vector<Pose>& poses);

}  // namespace fastcal
