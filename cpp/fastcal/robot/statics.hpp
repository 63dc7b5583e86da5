// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What weighs on every frame of the chain: links, payload and wrench, in a given (deflected) posture.
// A joint's load is z . sum_k ((p_k - o) x m_k g), the moment that all weights beyond it exert about its axis; it is
// minus the torque that KDL's and pinocchio's inverse dynamics give, which hold the arm. All six components are kept,
// for bearings and links bend too.
#pragma once

#include <vector>

#include "fastcal/robot/assembly.hpp"
#include "fastcal/robot/kinematics.hpp"
#include "fastcal/robot/state.hpp"

namespace fastcal {

/// Gravity [m/s^2] in the measuring frame, for a base that stands as T_world_base.
Eigen::Vector3d gravity_in_world(const RobotDescription& robot, const Pose& T_world_base);

/// Force and moment of the nominal compensator on its joint's frame, in its axes, about its origin; 0 where there is
/// none. What it does to the anchor cancels it for all frames before, so it belongs to this one frame's load alone.
Vector6d spring_load(const RobotDescription& robot, const Chain& chain, const std::vector<Pose>& T_world_frame);

/// Loads on all frames, 6 each: force and moment of all beyond the frame, in its axes, about its origin [N, N m].
/// What stands on a frame weighs on it. An arm's payload hangs behind its flange: its tool carries nothing of it, the
/// arm that it stands on does. State::weights are part of it where they are given. `load`: everything; `payload_load`:
/// payloads and wrenches alone. Both have 6 * Chain::twist_count() numbers, those of
/// loops as they are.
void frame_loads(const RobotDescription& robot, const Chain& chain, const std::vector<Pose>& T_world_frame,
                 const State& state, const Eigen::Vector3d& gravity, double* load, double* payload_load);

/// Adds what closed loops put on the frames: forces of their equations that hold the passive joints, which bear no load
/// of their own. `loops` as it closed them at these frames.
void add_loop_loads(const Chain& chain, const Assembler& loops, double* load, double* payload_load);

}  // namespace fastcal
