// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Where the arm in a URDF begins and ends. A URDF is a tree of links; a calibration needs one way through it.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace fastcal {

/// How a link is mounted on its parent.
struct LinkMount {
  std::string parent;    ///< empty: the root of the tree
  bool moves = false;    ///< by a joint of one degree of freedom
  bool is_free = false;  ///< by a floating or planar joint: no arm reaches across it
};

using LinkTree = std::map<std::string, LinkMount>;  ///< by the link's name

struct UrdfEnds {
  std::string base;
  std::string tip;
  std::vector<std::string> notes;  ///< what was chosen among several
};

/// The ends that are named, and for an empty name the one there is.
///
/// The base is the root, or the link below the last floating or planar joint. The tip is the leaf `tool0` (REP-199)
/// where exactly one moves; else, where all moving leaves hang on one last moving joint, the only leaf or that joint's
/// link. Throws InvalidInput where several tips remain; it lists them with their numbers of joints.
UrdfEnds choose_ends(const LinkTree& tree, const std::string& base_link, const std::string& tip_link);

}  // namespace fastcal
