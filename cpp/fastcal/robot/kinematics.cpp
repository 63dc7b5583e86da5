// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/kinematics.hpp"

#include <cmath>

#include "fastcal/math/se3.hpp"

namespace fastcal {
namespace {

void turn_about_z(double angle, Pose& T) {
  if (angle == 0) return;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const Eigen::Vector3d x = T.R.col(0);
  T.R.col(0) = c * x + s * T.R.col(1);
  T.R.col(1) = c * T.R.col(1) - s * x;
}

}  // namespace

void forward(const Chain& chain, const double* q, const Twists* xi, std::vector<Pose>& T_world_frame) {
  const int frames = chain.frame_count();
  T_world_frame.resize(static_cast<std::size_t>(frames));
  const FrameTree& tree = *chain.tree;
  for (int f = 0; f < frames; ++f) {
    const auto at = static_cast<std::size_t>(f);
    const int parent = tree.parent(f);
    Pose& T = T_world_frame[at];
    if (parent == kWorldFrame)
      T = chain.constants[at];
    else
      T = T_world_frame[static_cast<std::size_t>(parent)] * chain.constants[at];
    double turn = 0;
    if (const int joint = tree.joint(f); joint >= 0) {
      if (chain.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute)
        turn = q[joint];
      else
        T.p += q[joint] * T.R.col(2);
    }
    const bool only_turns = xi == nullptr || is_turn_about_z(xi->col(f));  // as most effects do: they move joints
    if (xi != nullptr && only_turns) turn += (*xi)(5, f);
    turn_about_z(turn, T);
    if (!only_turns) T = T * exp_se3(xi->col(f));
  }
}

}  // namespace fastcal
