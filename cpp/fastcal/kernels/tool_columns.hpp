// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Columns of numbers of the tool alone, how many is known when this is compiled. Compiled once an instruction set.
#pragma once

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/frame_lanes.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {

/// Poses of the measuring frame in a group of rows.
struct MeasuringFrame {
  double numbers[kPoseNumbers * kGroup] = {};
  constexpr MeasuringFrame() {
    for (int i = 0; i < kGroup; ++i) numbers[i] = numbers[4 * kGroup + i] = numbers[8 * kGroup + i] = 1;
  }
};
inline constexpr MeasuringFrame kMeasuringFrame;

/// A term in W rows, times the scale of its twist.
template <typename Lane>
FASTCAL_INLINE void size_of(const TwistTerm& term, double scale, int row, Lane& size) {
  size = term.size - Lane{};
  if (!term.rows) return;
  load(size, term.rows + row);
  size *= scale;
}

/// Numbers `stride` apart of a column, times their factors where there are any; `adds`: to what is there.
template <int Numbers, bool Weighted, typename Lane>
FASTCAL_INLINE void put(Lane* sum, const Lane* factors, int stride, double* column, bool adds = false) {
  for (int n = 0; n < Numbers; ++n) {
    if constexpr (Weighted) sum[n] *= factors[n];
    if (adds) {
      Lane before;
      load(before, column + n * stride);
      sum[n] += before;
    }
    store(column + n * stride, sum[n]);
  }
}

/// The columns of W rows, whose first is `row`. Poses, factors (numbers, stride) and columns (numbers, stride), `ld`
/// apart, begin at that row. A shift along an axis z of a frame moves the tool by z, a turn about z moves it by
/// z x lever and turns it by z. Of six numbers a shift leaves the last three as they are, and they are zero.
template <int W, int Numbers, bool Weighted>
FASTCAL_INLINE void tool_columns(const double* poses, int frame_count, const FrameTwists* twists, int twist_count,
                                 int row, const double* factors, int stride, double* columns, int ld) {
  using Lane = typename Vectors<W>::Lane;
  const double* tool = poses + (frame_count - 1) * kPoseNumbers * kGroup;
  Lane factor[Numbers], lever[3], z[3], sum[Numbers];
  for (int n = 0; Weighted && n < Numbers; ++n) load(factor[n], factors + n * stride);
  for (const FrameTwists* of = twists; of < twists + twist_count; ++of) {
    const double* frame = of->frame < 0 ? kMeasuringFrame.numbers : poses + of->frame * kPoseNumbers * kGroup;
    const auto column = [columns, ld](int k) { return columns + static_cast<long>(k) * ld; };
    for (int r = 0; r < 3; ++r) {
      load(lever[r], tool + (9 + r) * kGroup);
      load(z[r], frame + (9 + r) * kGroup);
      lever[r] -= z[r];
    }
    for (int k = 0; k < 3; ++k) {
      const FrameTwists::Unit &shift = of->units[k], &turn = of->units[3 + k];
      for (int r = 0; r < 3; ++r) load(z[r], frame + (3 * k + r) * kGroup);
      if (shift.column >= 0) {
        for (int n = 0; n < 3; ++n) sum[n] = shift.size * z[n];
        put<3, Weighted>(sum, factor, stride, column(shift.column));
      }
      if (turn.column >= 0) {
        for (Lane& along : z) along *= turn.size;
        cross(z, lever, sum);
        for (int n = 3; n < Numbers; ++n) sum[n] = z[n - 3];
        put<Numbers, Weighted>(sum, factor, stride, column(turn.column));
      }
    }
    for (int t = 0; t < of->other_count; ++t) {
      const TwistRows& twist = *of->others[t];
      for (int n = 0; n < Numbers; ++n) sum[n] = Lane{};
      for (int u = 0; u < twist.term_count; ++u) {
        const TwistTerm& term = twist.terms[u];
        Lane size;
        size_of(term, twist.scale, row, size);
        for (int r = 0; r < 3; ++r) {
          load(z[r], frame + (3 * term.axis + r) * kGroup);
          z[r] *= size;
        }
        if (!term.turns) {
          for (int n = 0; n < 3; ++n) sum[n] += z[n];
          continue;
        }
        for (int n = 0; n < 3; ++n) {
          sum[n] += z[(n + 1) % 3] * lever[(n + 2) % 3];
          sum[n] -= z[(n + 2) % 3] * lever[(n + 1) % 3];
        }
        for (int n = 3; n < Numbers; ++n) sum[n] += z[n - 3];
      }
      put<Numbers, Weighted>(sum, factor, stride, column(twist.column), twist.adds);
    }
  }
}

}  // namespace fastcal::kernels
