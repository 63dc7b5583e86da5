// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A URDF read as one chain of moving joints. Fixed joints are merged: their transforms go into the next joint's origin
// or the flange, their links' masses into the link that carries them. urdfdom is met in urdf.cpp only.
#pragma once

#include <string>
#include <vector>

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// One moving joint. The frame of its child link coincides with the joint's frame.
struct UrdfJoint {
  std::string name;
  JointType type = JointType::kRevolute;
  bool continuous = false;                          ///< no limits in the file: -2 pi to 2 pi stands here
  Pose origin;                                      ///< pose of the joint's frame in that of the moving joint before it
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit, in the joint's frame
  double lower = 0;                                 ///< [rad] or [m]
  double upper = 0;
  Body body;  ///< all that this joint moves and the next one does not
};

struct UrdfChain {
  std::string name;
  std::string base_link;
  std::string tip_link;
  std::vector<UrdfJoint> joints;
  Pose flange;                     ///< pose of tip_link in the frame of the last moving joint
  std::vector<std::string> notes;  ///< what was read in a way that the reader should know
};

/// The chain from `base_link` (empty: the root) to `tip_link` (empty: the only leaf) of a URDF given as text.
/// Throws InvalidInput where the text is no URDF, the links don't form a chain, or a joint on it is none that a
/// calibration can move (planar, floating, mimic). Joints beside the chain are held at 0, and that is noted.
UrdfChain read_urdf(const std::string& xml, const std::string& base_link = "", const std::string& tip_link = "");

}  // namespace fastcal
