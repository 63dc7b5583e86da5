// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Growth of the lengths of an arm, which leaves its joints, base and tool where they are.
#pragma once

#include "fastcal/effects/owners.hpp"

namespace fastcal {

/// The body twist of frame f that one unit of relative growth of its constant part C_f makes: (R_C R_Z)^T C_f.p, R_Z
/// the turn of the joint whose frame it is. Needs kFrames.
inline Vector6d growth(const State& state, int f) {
  const Pose& C = state.chain->constants[static_cast<std::size_t>(f)];
  Vector6d xi = Vector6d::Zero();
  xi.head<3>() = C.R.transpose() * C.p;
  const int joint = f / 2;
  if (f == joint_frame(joint) && state.chain->joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute)
    xi.head<3>() = Eigen::AngleAxisd(-state.q[joint], Eigen::Vector3d::UnitZ()) * xi.head<3>();
  return xi;
}

}  // namespace fastcal
