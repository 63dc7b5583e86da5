// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Cameras and boards of a cell: what each is fixed to, where it is there, and what of that is to be identified.
#pragma once

#include <string>
#include <vector>

#include "fastcal/math/types.hpp"
#include "fastcal/measurement/lens.hpp"
#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// What stands on a frame of the chain (kWorldFrame: in the measuring frame), at a pose that is known or a start.
struct Standing {
  std::string name;
  int frame = kWorldFrame;
  Pose T_frame_own;
  bool fixed = false;  ///< known; else its six numbers are identified
};

struct Camera : Standing {
  LensModel lens = LensModel::kPinhole;
  Intrinsics intrinsics = Intrinsics::Zero();
  int identified_intrinsics = 0;  ///< so many of its intrinsics, from the first on, are identified
};

struct Board : Standing {
  Eigen::Matrix3Xd corners;  ///< [m], in its own frame
};

struct Rig {
  std::vector<Camera> cameras;
  std::vector<Board> boards;
};

}  // namespace fastcal
