// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One damped step towards a pose that leaves no joint beyond its limits:
//   dq = argmin |J dq - e|^2 + damping |dq|^2,   dq = J^T (J J^T + damping 1)^-1 e = (J^T J + damping 1)^-1 J^T e,
// joints that would leave their limits stop there, and the others do what they can for the rest of the error.
#pragma once

#include <span>

#include "fastcal/robot/kinematics.hpp"

namespace fastcal {

constexpr int kMaxIkJoints = 24;

using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxIkJoints, 1>;
using JointLimits = Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMaxIkJoints, 2>;
using ToolJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxIkJoints>;

/// Motion of the tool, [v; w] in the axes of the measuring frame, by every joint; `T_world_frame` as forward() leaves
/// it.
ToolJacobian joint_jacobian(const Chain& chain, std::span<const Pose> T_world_frame);
/// The same into J (6, n), of as many joints as there are.
void fill_joint_jacobian(const Chain& chain, std::span<const Pose> T_world_frame,
                         Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J);

/// [p_target - p; the rotation vector from R to R_target], axes of the measuring frame.
Vector6d pose_error(const Pose& target, const Pose& tool);

/// q after one step; `J` and `e` in units that may be compared. Nothing moves where nothing can.
JointVector bounded_step(const ToolJacobian& J, const Vector6d& e, double damping, const JointLimits& limits,
                         const JointVector& q);

}  // namespace fastcal
