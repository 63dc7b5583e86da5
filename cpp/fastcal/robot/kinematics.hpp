// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Forward kinematics of a Chain and the motion of its tool under twists of its frames, one posture at a time.
#pragma once

#include <vector>

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// One body twist [v; w] a frame, then one column a loop: 6 x Chain::twist_count().
using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic>;
/// The part of a loop's column that lengthens its rod [m]; of its load the rod's pull [N].
constexpr int kAlongRod = 2;

/// Does the twist turn its frame about the frame's own z axis and nothing else (or nothing at all)? Such twists
/// commute.
template <typename Derived>
bool is_turn_about_z(const Eigen::MatrixBase<Derived>& xi) {
  return xi[0] == 0 && xi[1] == 0 && xi[2] == 0 && xi[3] == 0 && xi[4] == 0;
}

/// Poses of all frames in the measuring frame: T_f = T_parent C_f Z_f(q) exp(xi_f). `xi` null: no error twists.
void forward(const Chain& chain, const double* q, const Twists* xi, std::vector<Pose>& T_world_frame);

/// How the tool moves, [v; w] of its origin in the axes of the measuring frame, when frame `T_world_frame` makes the
/// body twist `xi`.
inline Vector6d tool_motion(const Pose& T_world_frame, const Eigen::Vector3d& p_world_tool, const Vector6d& xi) {
  Vector6d out;
  out.tail<3>().noalias() = T_world_frame.R * xi.tail<3>();
  out.head<3>().noalias() = T_world_frame.R * xi.head<3>();
  out.head<3>() += out.tail<3>().cross(p_world_tool - T_world_frame.p);
  return out;
}

}  // namespace fastcal
