// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/spring_block.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/robot/statics.hpp"

namespace fastcal {
namespace {

constexpr double kUpright = 1e-15;  // off the vertical by less, an axis is on it

/// Turns x, y of a vector.
void turn(double* v, double angle) {
  const Eigen::Vector2d turned = Eigen::Rotation2Dd(angle) * Eigen::Vector2d(v[0], v[1]);
  std::copy(turned.begin(), turned.end(), v);
}

}  // namespace

SpringBlock::SpringBlock(const RobotDescription& robot, const Chain& chain, const JointSprings& springs,
                         const kernels::FrameRows* frames)
    : springs_{frames, nullptr, chain.joint_count(), nullptr, nullptr, {}, {}},
      payload_mass_(springs.weights.payload_mass) {
  const Eigen::Vector3d gravity = gravity_in_world(robot, chain.constants[kBaseFrame]);
  for (int j = 0; j < chain.joint_count(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    const Pose& body = chain.body_frames[k];
    const double mass = robot.bodies[k].mass + springs.weights.mass[j];
    const Eigen::Vector3d moment =
        body.R * (mass * robot.bodies[k].com + springs.weights.moment.col(j)) + mass * body.p;
    joints_.push_back({chain.joint_types[k] == JointType::kPrismatic,
                       springs.compliance[j] * gravity.norm(),
                       mass,
                       {moment[0], moment[1], moment[2]},
                       1,
                       0,
                       nullptr,
                       nullptr});
  }
  const Eigen::Vector3d down = gravity.stableNormalized();
  const Eigen::Vector3d payload_at = robot.p_flange_payload + springs.weights.payload_shift;
  std::copy(down.begin(), down.end(), springs_.down);
  std::copy(payload_at.begin(), payload_at.end(), springs_.payload_at);
  set_links(chain);
}

/// Each link is Rz(before) T(p) Rx Rz(after): its joints take the turns about z.
void SpringBlock::set_links(const Chain& chain) {
  const int n = chain.joint_count();
  linked_ = springs_;
  linked_joints_ = joints_;
  Eigen::VectorXd phase = Eigen::VectorXd::Zero(n);
  for (int j = 0; j <= n; ++j) {
    Pose link = chain.constants[static_cast<std::size_t>(link_frame(j - 1))];  // the base's ahead of joint 0
    if (j < n) link = link * chain.constants[static_cast<std::size_t>(joint_frame(j))];
    const bool tilts = link.R(0, 2) != 0 || link.R(1, 2) != 0;
    const double side = link.R(1, 2) > 0 ? -1 : 1;  // of the two ways, that of the smaller turn: often none
    const double before = tilts ? std::atan2(side * link.R(0, 2), -side * link.R(1, 2)) : 0;
    turn(link.p.data(), -before);
    link.R = Eigen::AngleAxisd(-before, Eigen::Vector3d::UnitZ()) * link.R;
    const double about_x = std::atan2(-link.R(1, 2), link.R(2, 2));
    const double after = std::atan2(-link.R(0, 1), link.R(0, 0));
    links_.push_back({std::cos(about_x), std::sin(about_x), {link.p[0], link.p[1], link.p[2]}});
    if (j == 0) {
      turn(linked_.down, -before);
    } else {
      turn(linked_joints_[static_cast<std::size_t>(j - 1)].moment, -before);
      phase[j - 1] += before;
    }
    if (j < n) {
      phase[j] = after;
    } else {
      turn(linked_.payload_at, after);
    }
  }
  for (int j = 0; j < n; ++j) {
    linked_joints_[static_cast<std::size_t>(j)].cosine = std::cos(phase[j]);
    linked_joints_[static_cast<std::size_t>(j)].sine = std::sin(phase[j]);
  }
  hang_bodies();
  skip_upright_joints();
}

/// The weight of all bodies beyond a link, at its end, as a moment about its beginning.
void SpringBlock::hang_bodies() {
  double mass = 0;
  for (std::size_t j = linked_joints_.size(); --j > 0;) {
    mass += linked_joints_[j].mass;
    for (int r = 0; r < 3; ++r) linked_joints_[j - 1].moment[r] += mass * links_[j].p[r];
  }
}

/// No weight turns the first joints where they are upright: the others are the whole chain.
void SpringBlock::skip_upright_joints() {
  for (; upright_ < springs_.joint_count; ++upright_) {
    const kernels::SpringLink& link = links_[static_cast<std::size_t>(upright_)];
    const double* down = linked_.down;
    const double across = link.cosine * down[1] + link.sine * down[2];
    if (std::abs(down[0]) > kUpright || std::abs(across) > kUpright) break;
    const double along = link.cosine * down[2] - link.sine * down[1];
    linked_.down[0] = linked_.down[1] = 0;
    linked_.down[2] = along;
  }
  linked_.joint_count = springs_.joint_count - upright_;
  linked_.links = links_.data() + upright_;
}

bool SpringBlock::settle(const Samples& samples, Eigen::Index begin, int rows, int stride,
                         const std::vector<bool>& moved, const std::vector<bool>& tilted,
                         std::vector<AlignedNumbers>& place) {
  const int n = springs_.joint_count;
  if (samples.wrench.size() > 0 || n > kernels::kMostSprings) return false;
  bool linked = true;  // are the links the same in all rows?
  for (int f = 0; f <= 2 * n; ++f) {
    const auto k = static_cast<std::size_t>(f);
    const bool joint = f % 2 == 1;
    const bool slides = joint && joints_[k / 2].slides;
    linked &= !tilted[k] && !slides && (joint || !moved[k]);
    if (!joint) continue;
    // A turn about z and a tilt do not commute: their sum is one twist.
    if (tilted[k] && joints_[k / 2].give != 0) return false;
    for (auto* joints : {&joints_, &linked_joints_}) {
      (*joints)[k / 2].slide = slides ? place[k].data() + stride : nullptr;
      (*joints)[k / 2].sine_cosine = slides ? nullptr : place[k].data() + 2 * stride;
    }
  }
  bool loaded = false;
  double* payload = payload_.resize(stride);
  for (int i = 0; i < stride; ++i) {
    payload[i] = samples.payload.size() > 0 && i < rows ? samples.payload(begin + i, 0) : 0;
    if (payload[i] > 0) payload[i] += payload_mass_;
    loaded |= payload[i] != 0;
  }
  kernels::Springs& springs = linked ? linked_ : springs_;
  springs.joints = linked ? linked_joints_.data() + upright_ : joints_.data();
  springs.payload = loaded ? payload : nullptr;
  return kernels::settle_springs(springs, stride);
}

}  // namespace fastcal
