// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Equilibrium of arms whose joints give in proportion to their loads, many postures side by side: the turns d with
//   d_j = c_j tau_j(q + d),
// tau_j the torque about (force along) joint j of all weights beyond it. Plain arrays only, as in chain_rows.hpp.
#pragma once

#include "fastcal/kernels/chain_rows.hpp"

namespace fastcal::kernels {

constexpr int kMostSprings = 16;

/// A joint and the body that it moves.
struct SpringJoint {
  bool slides;
  double compliance;  ///< c [rad/(N m), m/N]
  double mass;        ///< [kg]
  double moment[3];   ///< mass times centre [kg m], in the joint's frame
};

struct Springs {
  const FrameRows* frames;  ///< the chain without the turns that are sought; joint j has frame 2 j + 1
  int joint_count;
  const SpringJoint* joints;
  const double* payload;  ///< [kg] by row
  double payload_at[3];   ///< [m], in the flange's frame
  double gravity[3];      ///< [m/s^2]
};

/// Turns (joint_count, stride) [rad, m] by Newton's method: the arm's gravity stiffness, d tau / d q, is that of the
/// undeflected posture. False where a row does not come to rest.
bool settle_springs(const Springs& springs, int stride, double* turns);

}  // namespace fastcal::kernels
