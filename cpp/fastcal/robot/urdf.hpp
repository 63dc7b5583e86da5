// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A URDF read as one chain of moving joints, or as a tree of them. Fixed joints are merged: their transforms go into
// the next joint's origin or the flange, their links' masses into the link that carries them. urdfdom is met in
// urdf.cpp only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// A joint that another one drives: its position is multiplier * position of joint `driver` of the chain + offset.
struct Mimic {
  int driver = -1;
  double multiplier = 1;
  double offset = 0;  ///< [rad] or [m]
};

/// One moving joint. The frame of its child link coincides with the joint's frame.
struct UrdfJoint {
  std::string name;
  JointType type = JointType::kRevolute;
  bool unlimited = false;                           ///< no limits in the file: -2 pi to 2 pi, -10 m to 10 m are used
  Pose mount;                                       ///< the fixed joints' part of `origin`: mount * the joint's own
  Pose origin;                                      ///< pose of the joint's frame in that of the moving joint before it
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit, in the joint's frame
  double lower = 0;                                 ///< [rad] or [m]
  double upper = 0;
  Body body;  ///< all that this joint moves and the next one does not
  std::optional<Mimic> mimic;
};

struct UrdfChain {
  std::string name;
  std::string base_link;
  std::string tip_link;
  std::vector<UrdfJoint> joints;
  Pose flange;                     ///< pose of tip_link in the frame of the last moving joint
  Body ahead;                      ///< what hangs on base_link and moves with it, on the way to the first moving joint
  std::vector<std::string> notes;  ///< what was read in a way that the reader should know
};

/// The chain from `base_link` to `tip_link` of a URDF given as text; an empty name is chosen as choose_ends() does.
/// Throws InvalidInput where the text is no URDF, the links don't form a chain, or a joint on it is none that a
/// calibration can move (planar, floating). Joints beside the chain are held at 0, and that is noted.
UrdfChain read_urdf(const std::string& xml, const std::string& base_link = "", const std::string& tip_link = "");

/// A chain of a URDF with several tips, and the one whose tip_link is its base_link; -1: it begins at the base.
struct UrdfBranch {
  int parent = -1;
  UrdfChain chain;
};

/// The chains from `base_link` to the tips as one tree: joints that ways to several tips share are those of one chain,
/// which ends at the link where the ways part. Parents come first; what a fork carries is a body of its chain. Throws
/// InvalidInput as read_urdf() does, and where no joint moves a tip by itself.
std::vector<UrdfBranch> read_urdf_tree(const std::string& xml, const std::string& base_link,
                                       const std::vector<std::string>& tip_links);

}  // namespace fastcal
