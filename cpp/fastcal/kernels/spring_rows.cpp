// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/spring_rows.hpp"

#include "fastcal/kernels/frame_lanes.hpp"
#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {
namespace {

constexpr int kMaxRounds = 20;
constexpr double kSettled = 1e-16;  // [rad, m]: what the step after the last would be

template <typename Lane>
FASTCAL_INLINE void cross(Lane (&out)[3], const Lane* a, const Lane* b) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

template <typename Lane>
FASTCAL_INLINE void dot(Lane& out, const Lane* a, const Lane* b) {
  out = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// W arms in one posture each; N: their joints where that is known when compiled, else 0.
template <int W, int N>
struct Arms {
  using Lane = typename Vectors<W>::Lane;
  using Mask = typename Vectors<W>::Mask;

  Lane axis[kMostSprings][3], origin[kMostSprings][3];  // of the joints
  Lane moment[kMostSprings][3];                         // mass times centre of their bodies
  Lane payload, payload_moment[3], gravity[3];
  Lane turn[kMostSprings];
  Lane short_of[kMostSprings];                // c tau - d
  Lane rigidity[kMostSprings][kMostSprings];  // 1 - c d tau / d q, then its factors L and U, U's diagonal inverted

  static FASTCAL_INLINE int joints(const Springs& springs) { return N > 0 ? N : springs.joint_count; }

  /// Axes, origins and moments where the joints are turned.
  FASTCAL_INLINE void place(const Springs& springs, int stride, int row) {
    Lane T[kPoseNumbers];
    for (int k = 0; k < kPoseNumbers; ++k) T[k] = Lane{} + (k == 0 || k == 4 || k == 8 ? 1.0 : 0.0);
    for (int f = 0; f <= 2 * joints(springs); ++f) {
      const FrameRows& frame = springs.frames[f];
      const int j = f / 2;
      const bool joint = f % 2 == 1;
      move_by_constant(T, frame);
      const bool slides = joint && springs.joints[j].slides;
      Lane value;
      if (frame.slide || slides) {
        value = Lane{};
        if (frame.slide) load(value, frame.slide + row);
        if (slides) value += turn[j];
        for (int r = 0; r < 3; ++r) T[9 + r] += value * T[6 + r];
      }
      if (frame.turn || (joint && !slides)) {
        Lane s, c;
        value = Lane{};
        if (frame.turn) load(value, frame.turn + row);
        if (joint && !slides) value += turn[j];
        sine_cosine<W>(value, s, c);
        fastcal::kernels::turn(T, T + 3, c, s);
      }
      if (frame.motion) {
        Lane M[kPoseNumbers];
        for (int k = 0; k < kPoseNumbers; ++k) load(M[k], frame.motion + k * stride + row);
        move(T, M);
      }
      if (!joint) continue;
      const SpringJoint& body = springs.joints[j];
      for (int r = 0; r < 3; ++r) {
        axis[j][r] = T[6 + r];
        origin[j][r] = T[9 + r];
        moment[j][r] =
            body.mass * T[9 + r] + body.moment[0] * T[r] + body.moment[1] * T[3 + r] + body.moment[2] * T[6 + r];
      }
    }
    for (int r = 0; r < 3; ++r) {
      payload_moment[r] = payload * (T[9 + r] + springs.payload_at[0] * T[r] + springs.payload_at[1] * T[3 + r] +
                                     springs.payload_at[2] * T[6 + r]);
    }
  }

  /// What the turns fall short of; `first`: the slopes of the loads as well,
  ///   d tau_i / d q_j = z_i . ((z_j x s_j) x g),  i <= j, symmetric,
  /// s_j the first moment [kg m] of all beyond joint j about its origin; for one that slides z_j x s_j is m z_j.
  FASTCAL_INLINE void weigh(const Springs& springs, bool first) {
    const int n = joints(springs);
    Lane mass = payload, sum[3], s[3], v[3];
    for (int r = 0; r < 3; ++r) sum[r] = payload_moment[r];
    for (int j = n - 1; j >= 0; --j) {
      const SpringJoint& joint = springs.joints[j];
      mass += joint.mass;
      for (int r = 0; r < 3; ++r) {
        sum[r] += moment[j][r];
        s[r] = sum[r] - mass * origin[j][r];
      }
      cross(v, s, gravity);
      Lane load;
      dot(load, axis[j], joint.slides ? gravity : v);
      if (joint.slides) load *= mass;
      short_of[j] = joint.compliance * load - turn[j];
      if (!first) continue;
      for (int r = 0; joint.slides && r < 3; ++r) s[r] = mass * axis[j][r];
      if (!joint.slides) {
        Lane moved[3];
        cross(moved, axis[j], s);
        for (int r = 0; r < 3; ++r) s[r] = moved[r];
      }
      cross(v, s, gravity);
      for (int i = 0; i <= j; ++i) {
        Lane slope{};
        if (!springs.joints[i].slides) dot(slope, axis[i], v);
        rigidity[i][j] = -springs.joints[i].compliance * slope;
        rigidity[j][i] = -joint.compliance * slope;
      }
    }
  }

  /// LU without pivots: near 1 for every arm that stands.
  FASTCAL_INLINE void factor(int n) {
    for (int k = 0; k < n; ++k) {
      rigidity[k][k] = 1.0 / (1.0 + rigidity[k][k]);
      for (int i = k + 1; i < n; ++i) {
        rigidity[i][k] *= rigidity[k][k];
        for (int j = k + 1; j < n; ++j) rigidity[i][j] -= rigidity[i][k] * rigidity[k][j];
      }
    }
  }

  /// The step of Newton instead of what was short.
  FASTCAL_INLINE void solve(int n) {
    for (int i = 1; i < n; ++i) {
      for (int k = 0; k < i; ++k) short_of[i] -= rigidity[i][k] * short_of[k];
    }
    for (int i = n - 1; i >= 0; --i) {
      for (int k = i + 1; k < n; ++k) short_of[i] -= rigidity[i][k] * short_of[k];
      short_of[i] *= rigidity[i][i];
    }
  }
};

template <int W, int N>
FASTCAL_INLINE void settle_arms(const Springs& springs, int stride, double* turns, bool& at_rest) {
  using Lane = typename Vectors<W>::Lane;
  using Mask = typename Vectors<W>::Mask;
  Arms<W, N> arms;
  const int n = arms.joints(springs);
  for (int r = 0; r < 3; ++r) arms.gravity[r] = Lane{} + springs.gravity[r];
  for (int row = 0; row < stride; row += W) {
    load(arms.payload, springs.payload + row);
    for (int j = 0; j < n; ++j) arms.turn[j] = Lane{};
    Mask moving = Lane{} == Lane{};
    Lane before = Lane{} + 1.0;
    bool any = true;
    for (int round = 0; any && round < kMaxRounds; ++round) {
      arms.place(springs, stride, row);
      arms.weigh(springs, round == 0);
      if (round == 0) arms.factor(n);
      arms.solve(n);
      Lane size = Lane{};
      for (int j = 0; j < n; ++j) {
        const Lane step = arms.short_of[j];
        arms.turn[j] = moving ? arms.turn[j] + step : arms.turn[j];
        size = size + (step < 0.0 ? -step : step);
      }
      moving &= ~(size * size <= kSettled * before);  // steps shrink by the same factor or a smaller one
      before = size;
      any = false;
      for (int l = 0; l < W; ++l) any |= moving[l] != 0;
    }
    at_rest &= !any;
    for (int j = 0; j < n; ++j) store(turns + j * stride + row, arms.turn[j]);
  }
}

template <int W>
FASTCAL_INLINE void settle_lanes(const Springs& springs, int stride, double* turns, bool& at_rest) {
  if (springs.joint_count == 6)
    settle_arms<W, 6>(springs, stride, turns, at_rest);
  else if (springs.joint_count == 7)
    settle_arms<W, 7>(springs, stride, turns, at_rest);
  else
    settle_arms<W, 0>(springs, stride, turns, at_rest);
}

FASTCAL_FOR_EACH_SET(springs, settle_lanes, (const Springs& s, int stride, double* turns, bool& at_rest),
                     (s, stride, turns, at_rest))

}  // namespace

bool settle_springs(const Springs& springs, int stride, double* turns) {
  static const auto run = FASTCAL_BEST_SET(springs);
  bool at_rest = true;
  run(springs, stride, turns, at_rest);
  return at_rest;
}

}  // namespace fastcal::kernels
