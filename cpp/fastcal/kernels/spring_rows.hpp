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

/// A joint and the body that it moves, and what its place in the chain depends on, by row.
struct SpringJoint {
  bool slides;
  double give;       ///< c |g| [rad/(kg m), m/kg]
  double mass;       ///< [kg]; with links it is in the moment of the joint before
  double moment[3];  ///< mass times centre [kg m], in the joint's frame; with links of all that is beyond the next too
  double cosine, sine;  ///< of what the joint's angle has beyond that of the chain: 1, 0 without links
  double* sine_cosine;  ///< (2, stride) of its angle; null for one that slides
  double* slide;        ///< [m]; null for one that turns
};

/// From one joint to the next where both may be turned about their z at will: T(p) Rx.
struct SpringLink {
  double cosine, sine;
  double p[3];  ///< [m]
};

struct Springs {
  const FrameRows* frames;  ///< the chain; joint j has frame 2 j + 1; unread where there are links
  const SpringLink* links;  ///< to each joint and to the flange; null where links differ by row or a joint slides
  int joint_count;
  const SpringJoint* joints;
  const double* payload;  ///< [kg] by row; null: none
  double payload_at[3];   ///< [m], in the flange's frame, behind the last link
  double down[3];         ///< direction of gravity in the measuring frame, before the first link
};

/// Moves the joints of the chain, by their sines and slides, to where the springs hold them. The first step is
/// Newton's, and so are the others of a soft arm; those of a stiff one repeat d = c tau. False where a row does not
/// come to rest.
bool settle_springs(const Springs& springs, int stride);

}  // namespace fastcal::kernels
