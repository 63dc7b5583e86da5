// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How the pose of a frame, kPoseNumbers lanes, follows from the one before. Compiled once an instruction set.
#pragma once

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {

/// R <- R A, p <- p + R a.
template <typename Lane, typename Number>
FASTCAL_INLINE void move(Lane (&T)[kPoseNumbers], const Number* A) {
  for (int r = 0; r < 3; ++r) {
    const Lane x = T[r], y = T[3 + r], z = T[6 + r];
    T[9 + r] += A[9] * x + A[10] * y + A[11] * z;
    for (int c = 0; c < 3; ++c) T[3 * c + r] = A[3 * c] * x + A[3 * c + 1] * y + A[3 * c + 2] * z;
  }
}

/// x' = c x + s y, y' = c y - s x: the axes x and y of T turned about the third.
template <typename Lane, typename Number>
FASTCAL_INLINE void turn(Lane* x, Lane* y, const Number& c, const Number& s) {
  for (int r = 0; r < 3; ++r) {
    const Lane before = x[r];
    x[r] = c * before + s * y[r];
    y[r] = c * y[r] - s * before;
  }
}

/// T <- T C.
template <typename Lane>
FASTCAL_INLINE void move_by_constant(Lane (&T)[kPoseNumbers], const FrameRows& frame) {
  const double* C = frame.constant;
  if (frame.constant_turn == Turn::kAny) return move(T, C);
  for (int k = 0; k < 3; ++k) {
    if (C[9 + k] == 0) continue;
    for (int r = 0; r < 3; ++r) T[9 + r] += C[9 + k] * T[3 * k + r];
  }
  if (frame.constant_turn == Turn::kAboutX) turn(T + 3, T + 6, C[4], C[5]);
  if (frame.constant_turn == Turn::kAboutZ) turn(T, T + 3, C[0], C[1]);
}

}  // namespace fastcal::kernels
