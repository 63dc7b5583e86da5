// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Corners that two cameras on the flange of the arm of scene.hpp see of one board, written with Ceres and independent
// of fastcal: a chain of turns and shifts, back from the corner to the camera, and Brown's lens.
#pragma once

#include <vector>

#include "elementary_motions.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal::bench {

inline constexpr int kRows = 50, kCameras = 2, kCorners = 50;  // 5,000 corners
inline constexpr int kLens = 9;                                // fx fy cx cy k1 k2 p1 p2 k3
inline constexpr int kGeometry = 24;                           // sizes and ratios of the arm that the pictures show
inline constexpr int kStanding = 6;

struct View {
  std::vector<int> free;  ///< kGeometry of the 30 sizes (rows of theta d a alpha beta) and 6 ratios behind them
  RowMatrixXd q;          ///< (kRows, 6)
  Pose T_flange_camera[kCameras], T_world_board;
  Eigen::Matrix<double, kLens, 1> lens[kCameras];
  Eigen::Matrix3Xd corners;  ///< (3, kCorners)
};

/// Numbers that are identified, from 0: geometry, then of each camera placement and lens, then the board's placement.
inline constexpr int kUnknowns = kGeometry + kCameras * (kStanding + kLens) + kStanding;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

/// (kRows, 2 kCameras kCorners) where the corners are drawn [px]; NaN where one is not before its camera.
RowMatrixXd drawn(const View& view, const Unknowns& x);

struct Solved {
  double rms = 0;      ///< [px] of a coordinate
  int iterations = 0;  ///< passes with derivatives
};

/// Least squares from 0.
Solved solve_with_ceres(const View& view, const RowMatrixXd& uv, Derivatives derivatives);

}  // namespace fastcal::bench
