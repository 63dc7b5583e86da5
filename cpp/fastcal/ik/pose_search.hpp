// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Levenberg's iteration from one posture to the nearest one whose tool is at a target, within limits:
//   minimize  |p - p*|^2 / reach^2 + angle(R, R*)^2,   damping = mu |e|^2,
// mu falling with every step that helps and rising with every one that does not. The damping vanishes with the error,
// so the end is quadratic, in singular postures too as far as there is an end (J. Fan, Y. Yuan, "On the quadratic
// convergence of the Levenberg-Marquardt method without nonsingularity assumption", 2005).
#pragma once

#include <functional>
#include <span>

#include "fastcal/ik/bounded_step.hpp"

namespace fastcal {

struct Goal {
  Pose target;
  double reach = 1;               ///< [m]
  double tolerance_position = 0;  ///< [m]
  double tolerance_rotation = 0;  ///< [rad]
  double rotation_weight = 1;     ///< what a turn counts beside a shift over the reach
};

/// The state of a search.
struct SearchPoint {
  JointVector q;
  Vector6d error = Vector6d::Zero();  ///< pose_error
  ToolJacobian J;                     ///< joint_jacobian
  double position_error = 0;          ///< [m]
  double rotation_error = 0;          ///< [rad]
  double cost = 0;                    ///< squared, lengths over the reach
  bool reached = false;
  int evaluations = 0;  ///< so far
};

/// The state at joint positions `q`, whose frames are given.
SearchPoint look(const Chain& chain, const Goal& goal, const JointVector& q, std::span<const Pose> frames);

/// q after a step of damping mu |e|^2.
JointVector step_from(const SearchPoint& point, const Goal& goal, double mu, const JointLimits& limits);

/// Frames of the robot at joint positions q, as forward() orders them.
using FramesAt = std::function<const std::vector<Pose>&(const JointVector& q)>;

/// Searches from `q`, in at most `max_evaluations`.
SearchPoint search_pose(const Chain& chain, const FramesAt& frames_at, const Goal& goal, const JointLimits& limits,
                        const JointVector& q, int max_evaluations);

/// The least singular value of J, lengths over the reach.
double least_singular_value(const Chain& chain, const ToolJacobian& J, double reach);

}  // namespace fastcal
