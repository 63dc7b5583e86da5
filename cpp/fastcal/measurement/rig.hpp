// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Cameras and boards of a cell: what each is fixed to, where it is there, and what of that is to be identified; how its
// frame moves while pictures are taken, and how a camera's mount gives:
//   T_world_camera(v) = T_world_frame exp(t motion) exp(sag) T_frame_camera,  t = delay + line_time (v - middle_line)
#pragma once

#include <string>
#include <vector>

#include "fastcal/math/se3.hpp"
#include "fastcal/math/types.hpp"
#include "fastcal/measurement/lens.hpp"
#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// What stands on a frame of the chain (kWorldFrame: in the measuring frame), at a pose that is known or a start.
struct Standing {
  std::string name;
  int frame = kWorldFrame;
  Pose T_frame_own;
  bool fixed = false;    ///< known; else its six numbers are identified
  RowMatrixXd motion{};  ///< (N, 6) twist [v; w] of its frame in each row, axes of the frame, a second; empty: at rest
};

/// A frame of the chain `seconds` after the joints were read: T exp(seconds motion).
inline Pose later(const Pose& T_world_frame, const RowMatrixXd& motion, Eigen::Index row, double seconds) {
  if (motion.size() == 0 || seconds == 0) return T_world_frame;
  return T_world_frame * exp_se3(seconds * Vector6d(motion.row(row)));
}

struct Camera : Standing {
  LensModel lens = LensModel::kPinhole;
  Intrinsics intrinsics = Intrinsics::Zero();
  int identified_intrinsics = 0;  ///< so many of its intrinsics, from the first on, are identified
  double delay = 0;               ///< [s] by which its pictures are later than the joints
  double line_time = 0;           ///< [s] by which a line of pixels is later than the one above it
  double middle_line = 0;         ///< v [px] of the line that is `delay` late
  RowMatrixXd sag{};  ///< (N, 6) small twist of the frame in each row, by which its mount gives; empty: none

  double seconds(double v) const { return delay + line_time * (v - middle_line); }

  /// Its frame when it took line v of row i, its mount as it is bent.
  Pose frame_at(const Pose& T_world_frame, Eigen::Index i, double v) const {
    const Pose moved = later(T_world_frame, motion, i, seconds(v));
    return sag.size() == 0 ? moved : moved * exp_se3(Vector6d(sag.row(i)));
  }
};

struct Board : Standing {
  Eigen::Matrix3Xd corners;  ///< [m], in its own frame
};

struct Rig {
  std::vector<Camera> cameras;
  std::vector<Board> boards;
};

}  // namespace fastcal
