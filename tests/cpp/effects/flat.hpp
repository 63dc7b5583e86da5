// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What physics tests of effects without load share: flat arms whose pose is worked out by hand.
#pragma once

#include <cmath>

#include "effects/loaded.hpp"

namespace fastcal::test {

/// Revolute joints about the upward axis, links of 1 m, no masses.
inline RobotModel flat_arm(int joints, const Pose& base = {}, const Pose& flange_tool = {}) {
  RobotDescription description;
  description.joint_types.assign(static_cast<std::size_t>(joints), JointType::kRevolute);
  description.T_world_base = base;
  description.T_flange_tool = flange_tool;
  RowMatrixXd rows = RowMatrixXd::Zero(joints, 5);
  rows.col(2).setOnes();
  return build_dh(description, rows);
}

/// How far the tool is turned about the upward axis.
inline double heading(const Pose& T) { return std::atan2(T.R(1, 0), T.R(0, 0)); }

inline Pose turned_base(double angle) {
  return {Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {0, 0, 0}};
}

}  // namespace fastcal::test
