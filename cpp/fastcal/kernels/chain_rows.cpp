// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/chain_rows.hpp"

#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {
namespace {

/// R <- R A, p <- p + R a.
template <typename Lane, typename Number>
FASTCAL_INLINE void move(Lane (&T)[kPoseNumbers], const Number* A) {
  for (int r = 0; r < 3; ++r) {
    const Lane x = T[r], y = T[3 + r], z = T[6 + r];
    T[9 + r] += A[9] * x + A[10] * y + A[11] * z;
    for (int c = 0; c < 3; ++c) T[3 * c + r] = A[3 * c] * x + A[3 * c + 1] * y + A[3 * c + 2] * z;
  }
}

/// A large angle has lost digits already; the polynomial holds below 1e6.
template <int W>
FASTCAL_INLINE void turn_about_z(typename Vectors<W>::Lane (&T)[kPoseNumbers], const typename Vectors<W>::Lane& angle) {
  typename Vectors<W>::Lane s, c;
  sine_cosine<W>(angle, s, c);
  for (int l = 0; l < W; ++l) {
    if (__builtin_fabs(angle[l]) > 1e5) {
      s[l] = __builtin_sin(angle[l]);
      c[l] = __builtin_cos(angle[l]);
    }
  }
  for (int r = 0; r < 3; ++r) {
    const auto x = T[r];
    T[r] = c * x + s * T[3 + r];
    T[3 + r] = c * T[3 + r] - s * x;
  }
}

template <int W>
FASTCAL_INLINE void forward_lanes(const FrameRows* frames, int frame_count, int stride, double* poses) {
  using Lane = typename Vectors<W>::Lane;
  for (int row = 0; row < stride; row += W) {
    double* out = poses + row / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    Lane T[kPoseNumbers];
    for (int k = 0; k < kPoseNumbers; ++k) T[k] = Lane{} + (k == 0 || k == 4 || k == 8 ? 1.0 : 0.0);
    for (int f = 0; f < frame_count; ++f) {
      const FrameRows& frame = frames[f];
      move(T, frame.constant);
      Lane value;
      if (frame.slide) {
        load(value, frame.slide + row);
        for (int r = 0; r < 3; ++r) T[9 + r] += value * T[6 + r];
      }
      if (frame.turn) {
        load(value, frame.turn + row);
        turn_about_z<W>(T, value);
      }
      if (frame.motion) {
        Lane M[kPoseNumbers];
        for (int k = 0; k < kPoseNumbers; ++k) load(M[k], frame.motion + k * stride + row);
        move(T, M);
      }
      for (int k = 0; k < kPoseNumbers; ++k, out += kGroup) store(out, T[k]);
    }
  }
}

/// What unit twists of one frame do to the numbers of W rows.
template <int W, int Fixed>
struct Units {
  using Lane = typename Vectors<W>::Lane;
  Lane by[6][kNumbers];

  FASTCAL_INLINE void of(const Lane* T, const Lane* tool, const NumberRows& numbers, int stride, int row) {
    Lane lever[3], across[9], factor, slope[6];
    for (int r = 0; r < 3; ++r) lever[r] = tool[r] - T[9 + r];
    for (int k = 0; k < 3; ++k) {
      const Lane* z = T + 3 * k;
      across[3 * k] = z[1] * lever[2] - z[2] * lever[1];
      across[3 * k + 1] = z[2] * lever[0] - z[0] * lever[2];
      across[3 * k + 2] = z[0] * lever[1] - z[1] * lever[0];
    }
    int n = 0;
    for (; n < 3 && (Fixed || numbers.position); ++n) {
      load(factor, numbers.factor + n * stride + row);
      for (int k = 0; k < 3; ++k) {
        by[k][n] = factor * T[3 * k + n];
        by[3 + k][n] = factor * across[3 * k + n];
      }
    }
    for (int o = 0; !Fixed && o < numbers.others; ++o, ++n) {
      load(factor, numbers.factor + n * stride + row);
      for (int k = 0; k < 6; ++k) {
        load(slope[k], numbers.slope + (6 * o + k) * stride + row);
        slope[k] *= factor;
      }
      for (int k = 0; k < 3; ++k) {
        const Lane *z = T + 3 * k, *x = across + 3 * k;
        by[k][n] = slope[0] * z[0] + slope[1] * z[1] + slope[2] * z[2];
        by[3 + k][n] =
            slope[0] * x[0] + slope[1] * x[1] + slope[2] * x[2] + slope[3] * z[0] + slope[4] * z[1] + slope[5] * z[2];
      }
    }
  }

  FASTCAL_INLINE void write(const TwistRows& twist, int count, int stride, int row) const {
    Lane sum[kNumbers], part;
    for (int n = 0; n < count; ++n) {
      sum[n] = Lane{};
      if (twist.adds) load(sum[n], twist.column + n * stride + row);
    }
    for (int k = 0; k < 6; ++k) {
      if (twist.part[k])
        load(part, twist.part[k] + row);
      else if (twist.xi[k] != 0)
        part = Lane{} + twist.xi[k];
      else
        continue;
      part *= twist.scale;
      for (int n = 0; n < count; ++n) sum[n] += part * by[k][n];
    }
    for (int n = 0; n < count; ++n) store(twist.column + n * stride + row, sum[n]);
  }
};

/// Fixed: three coordinates and no others, known when compiled.
template <int W, int Fixed>
FASTCAL_INLINE void columns_lanes(const double* poses, int frame_count, int stride, const TwistRows* twists,
                                  int twist_count, const NumberRows& numbers) {
  using Lane = typename Vectors<W>::Lane;
  const int count = Fixed ? 3 : (numbers.position ? 3 : 0) + numbers.others;
  for (int row = 0; row < stride; row += W) {
    const double* from = poses + row / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    Lane tool[3], T[kPoseNumbers];
    for (int r = 0; r < 3; ++r) load(tool[r], from + ((frame_count - 1) * kPoseNumbers + 9 + r) * kGroup);
    Units<W, Fixed> units;
    for (int t = 0; t < twist_count; ++t) {
      const TwistRows& twist = twists[t];
      if (t == 0 || twist.frame != twists[t - 1].frame) {
        for (int k = 0; k < kPoseNumbers; ++k) {
          if (twist.frame < 0)
            T[k] = Lane{} + (k == 0 || k == 4 || k == 8 ? 1.0 : 0.0);
          else
            load(T[k], from + (twist.frame * kPoseNumbers + k) * kGroup);
        }
        units.of(T, tool, numbers, stride, row);
      }
      units.write(twist, count, stride, row);
    }
  }
}

template <int W>
FASTCAL_INLINE void columns_of(const double* poses, int frame_count, int stride, const TwistRows* twists,
                               int twist_count, const NumberRows& numbers) {
  if (numbers.position && numbers.others == 0)
    columns_lanes<W, 1>(poses, frame_count, stride, twists, twist_count, numbers);
  else
    columns_lanes<W, 0>(poses, frame_count, stride, twists, twist_count, numbers);
}

FASTCAL_FOR_EACH_SET(forward, forward_lanes, (const FrameRows* f, int n, int stride, double* poses),
                     (f, n, stride, poses))
FASTCAL_FOR_EACH_SET(columns, columns_of,
                     (const double* poses, int n, int stride, const TwistRows* t, int count, const NumberRows& numbers),
                     (poses, n, stride, t, count, numbers))

}  // namespace

void forward_rows(const FrameRows* frames, int frame_count, int stride, double* poses) {
  static const auto run = FASTCAL_BEST_SET(forward);
  run(frames, frame_count, stride, poses);
}

void twist_columns(const double* poses, int frame_count, int stride, const TwistRows* twists, int twist_count,
                   const NumberRows& numbers) {
  static const auto run = FASTCAL_BEST_SET(columns);
  run(poses, frame_count, stride, twists, twist_count, numbers);
}

}  // namespace fastcal::kernels
