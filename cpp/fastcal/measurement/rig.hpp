// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Cameras and boards of a cell: what each is fixed to, where it is there, and what of that is to be identified; how its
// frame moves while pictures are taken, and how it is out of place in a row, as by a mount that gives:
//   T_world_own = T_world_frame exp(t motion) exp(shift) T_frame_own,  t = delay + line_time (v - middle_line)
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
  RowMatrixXd shift{};   ///< (N, 6) twist by which it is out of place in each row, axes of the frame; empty: none

  /// Its frame in row i, `seconds` after the joints were read.
  Pose frame_at(const Pose& T_world_frame, Eigen::Index i, double seconds) const {
    Pose out = T_world_frame;
    if (motion.size() > 0 && seconds != 0) out = out * exp_se3(seconds * Vector6d(motion.row(i)));
    if (shift.size() > 0) out = out * exp_se3(Vector6d(shift.row(i)));
    return out;
  }
};

struct Camera : Standing {
  LensModel lens = LensModel::kPinhole;
  Intrinsics intrinsics = Intrinsics::Zero();
  int identified_intrinsics = 0;  ///< so many of its intrinsics, from the first on, are identified
  double delay = 0;               ///< [s] by which its pictures are later than the joints
  double line_time = 0;           ///< [s] by which a line of pixels is later than the one above it
  double middle_line = 0;         ///< v [px] of the line that is `delay` late

  double seconds(double v) const { return delay + line_time * (v - middle_line); }
};

struct Board : Standing {
  Eigen::Matrix3Xd corners;  ///< [m], in its own frame
};

struct Rig {
  std::vector<Camera> cameras;
  std::vector<Board> boards;
};

}  // namespace fastcal
