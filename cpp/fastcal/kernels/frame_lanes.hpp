// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How the pose of a frame, kPoseNumbers lanes, follows from the one before. Compiled once an instruction set.
#pragma once

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {

template <typename Lane>
FASTCAL_INLINE void cross(const Lane* a, const Lane* b, Lane* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

template <typename Lane>
FASTCAL_INLINE void identity(Lane (&T)[kPoseNumbers]) {
  for (int k = 0; k < kPoseNumbers; ++k) T[k] = Lane{} + (k == 0 || k == 4 || k == 8 ? 1.0 : 0.0);
}

// The coordinates of a pose along an axis of the measuring frame depend on each other alone: `Axes` asks for the first
// two of them, or for all three.

/// R <- R A, p <- p + R a.
template <int Axes = 3, typename Lane, typename Number>
FASTCAL_INLINE void move(Lane (&T)[kPoseNumbers], const Number* A) {
  for (int r = 0; r < Axes; ++r) {
    const Lane x = T[r], y = T[3 + r], z = T[6 + r];
    T[9 + r] += A[9] * x + A[10] * y + A[11] * z;
    for (int c = 0; c < 3; ++c) T[3 * c + r] = A[3 * c] * x + A[3 * c + 1] * y + A[3 * c + 2] * z;
  }
}

/// x' = c x + s y, y' = c y - s x: the axes x and y of T turned about the third.
template <int Axes = 3, typename Lane, typename Number>
FASTCAL_INLINE void turn(Lane* x, Lane* y, const Number& c, const Number& s) {
  for (int r = 0; r < Axes; ++r) {
    const Lane before = x[r];
    x[r] = c * before + s * y[r];
    y[r] = c * y[r] - s * before;
  }
}

/// T, the pose where the steps before have come to, in as many rows as a Lane has.
template <int Axes = 3, typename Lane>
FASTCAL_INLINE void take(Lane (&T)[kPoseNumbers], const ChainStep& step, int stride, int row) {
  const auto shift = [&T](int axis, const auto& by) {
    for (int r = 0; r < Axes; ++r) T[9 + r] += by * T[3 * axis + r];
  };
  Lane a, b;
  switch (step.kind) {
    case ChainStep::Kind::kShift:
      if (step.axis == 0) shift(0, step.shift);
      if (step.axis == 1) shift(1, step.shift);
      if (step.axis == 2) shift(2, step.shift);
      break;
    case ChainStep::Kind::kTurnX:
      turn<Axes>(T + 3, T + 6, step.cosine, step.sine);
      break;
    case ChainStep::Kind::kTurnZ:
      turn<Axes>(T, T + 3, step.cosine, step.sine);
      break;
    case ChainStep::Kind::kMove:
      move<Axes>(T, step.rows);
      break;
    case ChainStep::Kind::kSlideRows:
      load(a, step.rows + row);
      shift(2, a);
      break;
    case ChainStep::Kind::kTurnRows:
      load(a, step.rows + row);
      load(b, step.rows + stride + row);
      turn<Axes>(T, T + 3, b, a);
      break;
    case ChainStep::Kind::kMoveRows: {
      Lane M[kPoseNumbers];
      for (int k = 0; k < kPoseNumbers; ++k) load(M[k], step.rows + k * stride + row);
      move<Axes>(T, M);
      break;
    }
    case ChainStep::Kind::kFrame:
    case ChainStep::Kind::kUnseen:
      break;
  }
}

/// `step` of a pose that is the identity: its zeros cost nothing.
template <typename Lane>
FASTCAL_INLINE void take_first(Lane (&T)[kPoseNumbers], const ChainStep& step, int stride, int row) {
  identity(T);
  if (step.kind != ChainStep::Kind::kTurnRows) return take(T, step, stride, row);
  load(T[1], step.rows + row);
  load(T[0], step.rows + stride + row);
  T[3] = -T[1];
  T[4] = T[0];
}

}  // namespace fastcal::kernels
