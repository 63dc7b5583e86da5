// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Columns of numbers of the tool alone, how many is known when this is compiled. Compiled once an instruction set.
#pragma once

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/frame_lanes.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {

/// A term in W rows, times the scale of its twist.
template <typename Lane>
FASTCAL_INLINE void size_of(const TwistTerm& term, double scale, int row, Lane& size) {
  size = term.size - Lane{};
  if (!term.rows) return;
  load(size, term.rows + row);
  size *= scale;
}

/// How the tool moves with twists of one frame, in a group of rows. A shift along an axis z of the frame moves it by z,
/// a turn about z moves it by z x lever and turns it by z.
template <int W, int Numbers>
struct ToolMotion {
  using Lane = typename Vectors<W>::Lane;
  static constexpr int kParts = kGroup / W;

  const double* frame = nullptr;  // its pose
  Lane lever[kParts][3];          // from its origin to the tool
  Lane seen[kParts][3];           // the same in its own axes

  FASTCAL_INLINE void enter(const double* pose, const double* tool) {
    frame = pose;
    for (int part = 0; part < kParts; ++part) {
      Lane origin, axis[3];
      for (int r = 0; r < 3; ++r) {
        load(lever[part][r], tool + (9 + r) * kGroup + part * W);
        load(origin, frame + (9 + r) * kGroup + part * W);
        lever[part][r] -= origin;
      }
      for (int k = 0; k < 3; ++k) {
        load_axis(k, part, axis);
        seen[part][k] = axis[0] * lever[part][0] + axis[1] * lever[part][1] + axis[2] * lever[part][2];
      }
    }
  }

  FASTCAL_INLINE void load_axis(int k, int part, Lane* axis) const {
    for (int r = 0; r < 3; ++r) load(axis[r], frame + (3 * k + r) * kGroup + part * W);
  }

  FASTCAL_INLINE void of_shift(int k, int part, Lane* sum) const {
    load_axis(k, part, sum);
    for (int n = 3; n < Numbers; ++n) sum[n] = Lane{};
  }

  FASTCAL_INLINE void of_turn(int k, int part, Lane* sum) const {
    Lane z[3];
    load_axis(k, part, z);
    cross(z, lever[part], sum);
    for (int n = 3; n < Numbers; ++n) sum[n] = z[n - 3];
  }

  /// Of a twist [v; w] that is the same in all rows: v + w x lever in the axes of the frame.
  FASTCAL_INLINE void of_twist(const double* twist, int part, Lane* sum) const {
    const double* w = twist + 3;
    const Lane* l = seen[part];
    Lane axis[3], v[3];
    for (int k = 0; k < 3; ++k) v[k] = twist[k] + (w[(k + 1) % 3] * l[(k + 2) % 3] - w[(k + 2) % 3] * l[(k + 1) % 3]);
    for (int k = 0; k < 3; ++k) {
      load_axis(k, part, axis);
      for (int n = 0; n < 3; ++n) sum[n] = k == 0 ? axis[n] * v[k] : sum[n] + axis[n] * v[k];
      for (int n = 3; n < Numbers; ++n) sum[n] = k == 0 ? axis[n - 3] * w[k] : sum[n] + axis[n - 3] * w[k];
    }
  }

  FASTCAL_INLINE void of_terms(const TwistRows& twist, int row, int part, Lane* sum) const {
    for (int n = 0; n < Numbers; ++n) sum[n] = Lane{};
    for (int u = 0; u < twist.term_count; ++u) {
      const TwistTerm& term = twist.terms[u];
      Lane size, z[3];
      load_axis(term.axis, part, z);
      size_of(term, twist.scale, row, size);
      for (Lane& along : z) along *= size;
      if (!term.turns) {
        for (int n = 0; n < 3; ++n) sum[n] += z[n];
        continue;
      }
      for (int n = 0; n < 3; ++n) {
        sum[n] += z[(n + 1) % 3] * lever[part][(n + 2) % 3];
        sum[n] -= z[(n + 2) % 3] * lever[part][(n + 1) % 3];
      }
      for (int n = 3; n < Numbers; ++n) sum[n] += z[n - 3];
    }
  }
};

/// The column of a twist in W rows, times their factors, or the twist's part of it.
template <int W, int Numbers, bool Weighted, typename Lane>
FASTCAL_INLINE void put(Lane (&sum)[Numbers], const double* factors, int stride, int row, double* column,
                        bool adds = false) {
  Lane other;
  for (int n = 0; Weighted && n < Numbers; ++n) {
    load(other, factors + n * stride + row);
    sum[n] *= other;
  }
  for (int n = 0; adds && n < Numbers; ++n) {
    load(other, column + n * stride + row);
    sum[n] += other;
  }
  for (int n = 0; n < Numbers; ++n) store(column + n * stride + row, sum[n]);
}

/// A group of rows at a time, so that a twist is looked at once.
template <int W, int Numbers, bool Weighted>
FASTCAL_INLINE void tool_columns(const double* poses, int frame_count, int stride, const TwistRows* const* twists,
                                 int twist_count, const double* factors, double* columns, int ld) {
  using Motion = ToolMotion<W, Numbers>;
  using Kind = TwistRows::Kind;
  typename Motion::Lane sum[Numbers];
  double still[kPoseNumbers * kGroup];  // the measuring frame
  for (int k = 0; k < kPoseNumbers * kGroup; ++k) still[k] = k / kGroup % 4 == 0 && k / kGroup < 9 ? 1.0 : 0.0;
  for (int first = 0; first < stride; first += kGroup) {
    const double* from = poses + first * frame_count * kPoseNumbers;
    const double* tool = from + (frame_count - 1) * kPoseNumbers * kGroup;
    Motion motion;
    for (int t = 0; t < twist_count; ++t) {
      const TwistRows& twist = *twists[t];
      if (t == 0 || twist.frame != twists[t - 1]->frame)
        motion.enter(twist.frame < 0 ? still : from + twist.frame * kPoseNumbers * kGroup, tool);
      double* column = columns + static_cast<long>(twist.column) * ld;
      const int axis = twist.terms[0].axis;
      if (twist.kind == Kind::kShift) {
        for (int part = 0; part < Motion::kParts; ++part) {
          motion.of_shift(axis, part, sum);
          put<W, Numbers, Weighted>(sum, factors, stride, first + part * W, column);
        }
      } else if (twist.kind == Kind::kTurn) {
        for (int part = 0; part < Motion::kParts; ++part) {
          motion.of_turn(axis, part, sum);
          put<W, Numbers, Weighted>(sum, factors, stride, first + part * W, column);
        }
      } else if (twist.kind == Kind::kFixed) {
        for (int part = 0; part < Motion::kParts; ++part) {
          motion.of_twist(twist.fixed, part, sum);
          put<W, Numbers, Weighted>(sum, factors, stride, first + part * W, column);
        }
      } else {
        for (int part = 0; part < Motion::kParts; ++part) {
          const int row = first + part * W;
          motion.of_terms(twist, row, part, sum);
          put<W, Numbers, Weighted>(sum, factors, stride, row, column, twist.adds);
        }
      }
    }
  }
}

}  // namespace fastcal::kernels
