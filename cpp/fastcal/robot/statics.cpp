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

  void add(const Wrench& other) {
    force += other.force;
    moment += other.moment;
  }

  /// The weight of a mass whose first moment (mass times centre) is given in `frame`.
  void add_weight(double mass, const Eigen::Vector3d& moment_in_frame, const Pose& frame,
                  const Eigen::Vector3d& gravity) {
    force += mass * gravity;
    moment += (frame.R * moment_in_frame + mass * frame.p).cross(gravity);
  }

  /// In the axes of a frame, about its origin.
  void write(const Pose& frame, double* out) const {
    Eigen::Map<Eigen::Vector3d>(out).noalias() = frame.R.transpose() * force;
    Eigen::Map<Eigen::Vector3d>(out + 3).noalias() = frame.R.transpose() * (moment - frame.p.cross(force));
  }
};

/// Of the arm that ends with a branch, whose conditions `state` has.
Wrench payload_wrench(const Hand& hand, const Pose& base, const Branch& branch, const std::vector<Pose>& T_world_frame,
                      const State& state, const Eigen::Vector3d& gravity) {
  const auto last = static_cast<std::size_t>(branch.end() - 1);
  const Pose& flange = T_world_frame[last - 1];
  const Pose& tool = T_world_frame[last];
  const Eigen::Vector3d at = flange * hand.p_flange_payload;
  Wrench out;
  if (state.payload > 0 && state.weights != nullptr) {
    out.add((state.payload + state.weights->payload_mass) * gravity,
            flange * (hand.p_flange_payload + state.weights->payload_shift));
  } else {
    out.add(state.payload * gravity, at);
  }
  if (state.wrench != nullptr) {
    const Eigen::Matrix3d& R = hand.wrench_frame == WrenchFrame::kBase     ? base.R
                               : hand.wrench_frame == WrenchFrame::kFlange ? flange.R
                                                                           : tool.R;
    out.add(R * Eigen::Map<const Eigen::Vector3d>(state.wrench), at);
    out.moment += R * Eigen::Map<const Eigen::Vector3d>(state.wrench + 3);
  }
  return out;
}

}  // namespace

Eigen::Vector3d gravity_in_world(const RobotDescription& robot, const Pose& T_world_base) {
  return robot.gravity_in_world ? robot.gravity : (T_world_base.R * robot.gravity).eval();
}

Vector6d spring_load(const RobotDescription& robot, const Chain& chain, const std::vector<Pose>& T_world_frame) {
  Vector6d out = Vector6d::Zero();
  if (!robot.compensator) return out;
  const Compensator& spring = *robot.compensator;
  const int joint = chain.tree->frame_of_joint(spring.joint);
  const auto frame = static_cast<std::size_t>(joint);
  const auto before = static_cast<std::size_t>(chain.tree->parent(joint));
  const Eigen::Vector3d anchor =
      T_world_frame[frame].inverse() * (T_world_frame[before] * (chain.constants[frame] * spring.anchor));
  const Eigen::Vector3d span = anchor - spring.arm;
  const double length = span.norm();
  if (length > 0) out.head<3>() = spring.stiffness * (1 - spring.free_length / length) * span;
  out.tail<3>() = spring.arm.cross(out.head<3>());
  return out;
}

void frame_loads(const RobotDescription& robot, const Chain& chain, const std::vector<Pose>& T_world_frame,
                 const State& state, const Eigen::Vector3d& gravity, double* load, double* payload_load) {
  const FrameTree& tree = *chain.tree;
  struct Carried {
    Wrench all, payloads;
  };
  std::vector<Carried> on(tree.branches().size() > 1 ? T_world_frame.size() : 0);  // by other branches, by frame
  bool carries = false;                                                            // any arm so far
  if (!on.empty()) std::fill(payload_load, payload_load + 6 * tree.frame_count(), 0.0);
  for (std::size_t b = tree.branches().size(); b-- > 0;) {
    const Branch& branch = tree.branches()[b];
    Wrench sum, held, payload;
    const auto collect = [&](int frame) {
      sum.add(on[static_cast<std::size_t>(frame)].all);
      held.add(on[static_cast<std::size_t>(frame)].payloads);
    };
    const auto write = [&](int frame) {
      const Pose& T = T_world_frame[static_cast<std::size_t>(frame)];
      sum.write(T, load + 6 * frame);
      if (carries) held.write(T, payload_load + 6 * frame);
    };
    if (branch.arm >= 0) {
      const Pose& base = T_world_frame[static_cast<std::size_t>(tree.is_arm() ? kBaseFrame : branch.first_frame)];
      const auto hung = [&](const State& own) {
        return payload_wrench(robot.hand(branch.arm), base, branch, T_world_frame, own, gravity);
      };
      payload = branch.arm == 0 ? hung(state) : hung(state.of_arm(branch.arm));
      carries = carries || !payload.force.isZero(0) || !payload.moment.isZero(0);
    }
    int frame = branch.end() - 1;
    if (branch.arm >= 0) {
      // The payload hangs behind the flange: on the tool weighs what stands on it, and of a serial arm nothing does.
      if (on.empty()) {
        std::fill_n(load + 6 * frame, 6, 0.0);
        if (carries) std::fill_n(payload_load + 6 * frame, 6, 0.0);
      } else {
        collect(frame);
        write(frame);
      }
      sum.add(payload);
      held.add(payload);
      --frame;
    }
    for (; frame >= branch.first_frame; --frame) {
      if (!on.empty()) collect(frame);
      if (const int joint = tree.joint(frame); joint >= 0) {
        const auto i = static_cast<std::size_t>(joint);
        const Body& body = robot.bodies[i];
        const double mass = body.mass + (state.weights != nullptr ? state.weights->mass[joint] : 0);
        Eigen::Vector3d moment = mass * body.com;
        if (state.weights != nullptr) moment += state.weights->moment.col(joint);
        if (mass != 0 || !moment.isZero(0)) {
          const Pose& own = chain.body_frames[i];
          sum.add_weight(mass, own.R * moment + mass * own.p, T_world_frame[static_cast<std::size_t>(frame)], gravity);
        }
      }
      write(frame);
    }
    if (branch.parent != kWorldFrame) {
      on[static_cast<std::size_t>(branch.parent)].all.add(sum);
      on[static_cast<std::size_t>(branch.parent)].payloads.add(held);
    }
  }
  if (!carries && on.empty()) std::fill(payload_load, payload_load + 6 * tree.frame_count(), 0.0);
  if (robot.compensator) {
    const double scale = state.weights != nullptr ? 1 + state.weights->spring_scale : 1;
    Eigen::Map<Vector6d>(load + 6 * tree.frame_of_joint(robot.compensator->joint)) +=
        scale * spring_load(robot, chain, T_world_frame);
  }
}

}  // namespace fastcal
