// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/statics.hpp"

#include <algorithm>

namespace fastcal {
namespace {

/// A force and its moment about the origin of the measuring frame.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();

  void add(const Eigen::Vector3d& f, const Eigen::Vector3d& at) {
    force += f;
    moment += at.cross(f);
  }

  /// In the axes of a frame, about its origin.
  void write(const Pose& frame, double* out) const {
    Eigen::Map<Eigen::Vector3d>(out).noalias() = frame.R.transpose() * force;
    Eigen::Map<Eigen::Vector3d>(out + 3).noalias() = frame.R.transpose() * (moment - frame.p.cross(force));
  }
};

Wrench payload_wrench(const RobotDescription& robot, const std::vector<Pose>& T_world_frame, const State& state, const Eigen::Vector3d& gravity) {
  const Pose& base = T_world_frame.front();
  const Pose& flange = T_world_frame[T_world_frame.size() - 2];
  const Pose& tool = T_world_frame.back();
  const Eigen::Vector3d at = flange * robot.p_flange_payload;
  Wrench out;
  out.add(state.payload * gravity, at);
  if (state.wrench != nullptr) {
    const Eigen::Matrix3d& R = robot.wrench_frame == WrenchFrame::kBase ? base.R : robot.wrench_frame == WrenchFrame::kFlange ? flange.R : tool.R;
    out.add(R * Eigen::Map<const Eigen::Vector3d>(state.wrench), at);
    out.moment += R * Eigen::Map<const Eigen::Vector3d>(state.wrench + 3);
  }
  return out;
}

}  // namespace

Eigen::Vector3d gravity_in_world(const RobotDescription& robot, const Pose& T_world_base) {
  return robot.gravity_in_world ? robot.gravity : (T_world_base.R * robot.gravity).eval();
}

void frame_loads(const RobotDescription& robot, const Chain& chain, const std::vector<Pose>& T_world_frame, const State& state,
                 const Eigen::Vector3d& gravity, double* load, double* payload_load) {
  const int n = chain.joint_count();
  const Wrench payload = payload_wrench(robot, T_world_frame, state, gravity);
  Wrench sum = payload;
  const auto write = [&](int frame) {
    const Pose& T = T_world_frame[static_cast<std::size_t>(frame)];
    sum.write(T, load + 6 * frame);
    payload.write(T, payload_load + 6 * frame);
  };
  std::fill(load + 6 * tool_frame(n), load + 6 * tool_frame(n) + 6, 0.0);
  std::fill(payload_load + 6 * tool_frame(n), payload_load + 6 * tool_frame(n) + 6, 0.0);
  for (int joint = n - 1; joint >= 0; --joint) {
    write(link_frame(joint));
    const auto i = static_cast<std::size_t>(joint);
    const Body& body = robot.bodies[i];
    if (body.mass != 0) {
      const Pose& T_joint = T_world_frame[static_cast<std::size_t>(joint_frame(joint))];
      sum.add(body.mass * gravity, T_joint * (chain.body_frames[i] * body.com));
    }
    write(joint_frame(joint));
  }
  write(kBaseFrame);
}

}  // namespace fastcal
