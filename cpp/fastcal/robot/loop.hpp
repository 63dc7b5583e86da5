// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What closes a loop of the tree: equations between two of its frames, or between its joints, that hold in every
// posture. As many as there are passive joints, they say where these are.
//   pose   components of the pose of a pin of one frame, seen from a pin of another, are 0
//   rod    the distance of two pins is a length, which joints may add to:  |p_to - p_from| = length + sum c_j turn_j
//   gear   a joint turns with others:  turn = sum ratio_j turn_j + offset
// turn_j: a joint's position with all that effects add to it about (along) its axis.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "fastcal/math/types.hpp"
#include "fastcal/robot/frame_tree.hpp"

namespace fastcal {

struct Loop {
  enum class Kind { kPose, kRod, kGear };
  std::string name;  ///< owner of its parameters
  Kind kind = Kind::kPose;
  View frames;                                     ///< target: `to`, sensor: `from`; not of a gear
  Pose from, to;                                   ///< the pins in their frames [m]
  bool knows_from = true, knows_to = true;         ///< is the pin's place a parameter? Of a rod always both
  std::vector<int> fixed;                          ///< of a pose: 0 ... 5 for x y z rx ry rz, ascending
  double length = 0;                               ///< of a rod [m]; of a gear its offset [rad, m]
  int driven = -1;                                 ///< of a gear: the joint that the others turn
  std::vector<std::pair<int, double>> joints;      ///< of a gear: joints and their ratios; of a rod: c_j
  int first_parameter = -1;                        ///< of the robot that it is part of
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< [rad] of the first pin about its x, y, z, in `from` already

  /// Equations that it stands for.
  int row_count() const { return kind == Kind::kPose ? static_cast<int>(fixed.size()) : 1; }
  /// Does it fix a turn of the pins, so that the turn of the first one is a parameter?
  bool turns() const { return kind == Kind::kPose && knows_from && !fixed.empty() && fixed.back() >= 3; }
};

}  // namespace fastcal
