// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The equations of loops and their derivatives. S = T_from P is the pin's frame, in whose axes a pose is looked at:
//   p = S^-1 p_to,  d p = R_S^T (v_to - v_from - w_from x (p_to - p_from)),  dR = [R_S^T (w_to - w_from)]x R
// Two turns that are fixed hold the third axis of the pins parallel, one or three are parts of the rotation vector.
#include <algorithm>

#include "fastcal/math/se3.hpp"
#include "fastcal/robot/assembly.hpp"

namespace fastcal {
namespace {

struct Pins {
  Pose from, to, S, E;  // frames and, with the pins, where these are
};

Pins pins_of(const Loop& loop, std::span<const Pose> T) {
  const auto pose = [&T](int frame) { return frame == kWorldFrame ? Pose() : T[static_cast<std::size_t>(frame)]; };
  Pins out;
  out.from = pose(loop.frames.sensor);
  out.to = pose(loop.frames.target);
  out.S = out.from * loop.from;
  out.E = out.to * loop.to;
  return out;
}

/// Derivatives by the pins' places, in the axes of their frames.
void add_places(const Loop& loop, const Eigen::Vector3d& by_from, const Eigen::Vector3d& by_to, LoopRow& row) {
  int at = loop.first_parameter;
  if (loop.knows_from) {
    for (int k = 0; k < 3; ++k) row.by_parameter.emplace_back(at + k, by_from[k]);
    at += 3;
  }
  if (!loop.knows_to) return;
  for (int k = 0; k < 3; ++k) row.by_parameter.emplace_back(at + k, by_to[k]);
}

LoopRow rod_row(const Loop& loop, const Pins& pins) {
  LoopRow row;
  row.frames = loop.frames;
  const Eigen::Vector3d span = pins.E.p - pins.S.p;
  const double length = span.norm();
  const Eigen::Vector3d u = length > 0 ? (span / length).eval() : Eigen::Vector3d::UnitZ();
  row.value = length - loop.length;
  row.by_target << u, (pins.E.p - pins.to.p).cross(u);
  row.by_sensor << -u, -(pins.S.p - pins.from.p).cross(u);
  add_places(loop, -(pins.from.R.transpose() * u), pins.to.R.transpose() * u, row);
  row.by_parameter.emplace_back(loop.first_parameter + 6, -1.0);
  for (const auto& [joint, share] : loop.joints) row.by_turn.emplace_back(joint, -share);
  return row;
}

LoopRow gear_row(const Loop& loop) {
  LoopRow row;
  row.value = -loop.length;
  row.by_turn.emplace_back(loop.driven, 1.0);
  for (const auto& [joint, ratio] : loop.joints) row.by_turn.emplace_back(joint, -ratio);
  row.by_parameter.emplace_back(loop.first_parameter + static_cast<int>(loop.joints.size()), -1.0);
  return row;
}

/// a (pin's axes) of a turn that is fixed: d value = a . w; and the value.
std::pair<double, Eigen::Vector3d> turn_row(const Loop& loop, int part, const Eigen::Matrix3d& R) {
  const auto turns = std::count_if(loop.fixed.begin(), loop.fixed.end(), [](int c) { return c >= 3; });
  if (turns != 2) {
    const Eigen::Vector3d w = log_so3(R);
    return {w[part], right_jacobian_inverse_so3(w).col(part)};
  }
  int axis = 0;  // the one that is free
  while (std::find(loop.fixed.begin(), loop.fixed.end(), 3 + axis) != loop.fixed.end()) ++axis;
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  const Eigen::Vector3d z = R.col(axis);
  if (part == i) return {-z[j], -z.cross(Eigen::Vector3d::Unit(j))};
  return {z[i], z.cross(Eigen::Vector3d::Unit(i))};
}

LoopRow pose_row(const Loop& loop, int component, const Pins& pins) {
  LoopRow row;
  row.frames = loop.frames;
  const Eigen::Matrix3d& R_S = pins.S.R;
  const Eigen::Vector3d p = R_S.transpose() * (pins.E.p - pins.S.p);
  Eigen::Vector3d by_turn;  // by the turn of the first pin, its axes
  if (component < 3) {
    const Eigen::Vector3d axis = R_S.col(component);
    row.value = p[component];
    row.by_target << axis, (pins.E.p - pins.to.p).cross(axis);
    row.by_sensor << -axis, -(pins.E.p - pins.from.p).cross(axis);
    add_places(loop, -(pins.from.R.transpose() * axis), pins.to.R.transpose() * axis, row);
    by_turn = -p.cross(Eigen::Vector3d::Unit(component));
  } else {
    const auto [value, a] = turn_row(loop, component - 3, R_S.transpose() * pins.E.R);
    row.value = value;
    row.by_target << Eigen::Vector3d::Zero(), R_S * a;
    row.by_sensor = -row.by_target;
    by_turn = -a;
  }
  if (loop.turns()) {
    const int first = loop.first_parameter + 3 + (loop.knows_to ? 3 : 0);
    // The pin's turns are read off at their values: R = R_0 Rx Ry Rz, kept in Loop::turn.
    const Eigen::Matrix3d Rz = Eigen::AngleAxisd(loop.turn[2], Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Matrix3d Ry = Eigen::AngleAxisd(loop.turn[1], Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Vector3d wx = Rz.transpose() * (Ry.transpose() * Eigen::Vector3d::UnitX());
    const Eigen::Vector3d wy = Rz.transpose() * Eigen::Vector3d::UnitY();
    row.by_parameter.emplace_back(first, by_turn.dot(wx));
    row.by_parameter.emplace_back(first + 1, by_turn.dot(wy));
    row.by_parameter.emplace_back(first + 2, by_turn.z());
  }
  return row;
}

}  // namespace

std::vector<LoopRow> loop_rows(const Chain& chain, std::span<const Pose> T_world_frame, const double* q,
                               const Twists* xi, bool all) {
  const auto turn = [&](int joint) {
    const int part = chain.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2;
    return q[joint] + (xi != nullptr ? (*xi)(part, chain.tree->frame_of_joint(joint)) : 0.0);
  };
  std::vector<LoopRow> out;
  const auto add = [&](const Loop& loop, int c) {
    if (loop.kind == Loop::Kind::kGear) {
      out.push_back(gear_row(loop));
      for (std::size_t k = 0; k < loop.joints.size(); ++k)
        out.back().by_parameter.emplace_back(loop.first_parameter + static_cast<int>(k),
                                             q != nullptr ? -turn(loop.joints[k].first) : 0.0);
    } else {
      const Pins pins = pins_of(loop, T_world_frame);
      out.push_back(loop.kind == Loop::Kind::kRod ? rod_row(loop, pins)
                                                  : pose_row(loop, loop.fixed[static_cast<std::size_t>(c)], pins));
    }
    if (loop.kind == Loop::Kind::kRod) {
      LoopRow& row = out.back();
      row.rod = chain.rod_twist(static_cast<int>(&loop - chain.loops.data()));
      if (xi != nullptr) row.value -= (*xi)(kAlongRod, row.rod);
    }
    if (q == nullptr) return;
    for (const auto& [joint, share] : out.back().by_turn) out.back().value += share * turn(joint);
  };
  if (!all) {
    for (const auto& [loop, c] : chain.loop_rows) add(chain.loops[static_cast<std::size_t>(loop)], c);
    return out;
  }
  for (const Loop& loop : chain.loops) {
    for (int c = 0; c < loop.row_count(); ++c) add(loop, c);
  }
  return out;
}

Vector6d joint_axis(const Chain& chain, int joint, const Twists* xi) {
  const int part = chain.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2;
  const Vector6d z = Vector6d::Unit(part);
  if (xi == nullptr) return z;
  const Vector6d error = xi->col(chain.tree->frame_of_joint(joint));
  return is_turn_about_z(error) ? z : (adjoint(exp_se3(error).inverse()) * z).eval();
}

double by_joint(const Chain& chain, const LoopRow& row, std::span<const Pose> T_world_frame, int joint,
                const Twists* xi) {
  const FrameTree& tree = *chain.tree;
  const int frame = tree.frame_of_joint(joint);
  double out = 0;
  for (const auto& [other, share] : row.by_turn) out += other == joint ? share : 0.0;
  const bool moves_target = row.frames.target != kWorldFrame && tree.carries(frame, row.frames.target);
  const bool moves_sensor = row.frames.sensor != kWorldFrame && tree.carries(frame, row.frames.sensor);
  if (!moves_target && !moves_sensor) return out;
  const Vector6d along = joint_axis(chain, joint, xi);
  const Pose& T = T_world_frame[static_cast<std::size_t>(frame)];
  if (moves_target)
    out += row.by_target.dot(tool_motion(T, T_world_frame[static_cast<std::size_t>(row.frames.target)].p, along));
  if (moves_sensor)
    out += row.by_sensor.dot(tool_motion(T, T_world_frame[static_cast<std::size_t>(row.frames.sensor)].p, along));
  return out;
}

}  // namespace fastcal
