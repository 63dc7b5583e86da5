// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/chain_rows.hpp"

#include "fastcal/kernels/frame_lanes.hpp"
#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {
namespace {

constexpr double kLargeAngle = 1e5;  // it has lost digits already; the polynomials hold below 1e6

/// Far: angles are large, and the library's sines are taken.
template <int W, bool Far>
FASTCAL_INLINE void forward_group(const FrameRows* frames, int frame_count, int stride, int row, double* out,
                                  typename Vectors<W>::Mask& large) {
  using Lane = typename Vectors<W>::Lane;
  Lane T[kPoseNumbers];
  for (int k = 0; k < kPoseNumbers; ++k) T[k] = Lane{} + (k == 0 || k == 4 || k == 8 ? 1.0 : 0.0);
  for (int f = 0; f < frame_count; ++f, out += kPoseNumbers * kGroup) {
    const FrameRows& frame = frames[f];
    move_by_constant(T, frame);
    Lane value;
    if (frame.slide) {
      load(value, frame.slide + row);
      for (int r = 0; r < 3; ++r) T[9 + r] += value * T[6 + r];
    }
    if (frame.turn) {
      Lane s, c;
      load(value, frame.turn + row);
      large |= (value > kLargeAngle) | (value < -kLargeAngle);
      sine_cosine<W>(value, s, c);
      for (int l = 0; Far && l < W; ++l) {
        if (__builtin_fabs(value[l]) <= kLargeAngle) continue;
        s[l] = __builtin_sin(value[l]);
        c[l] = __builtin_cos(value[l]);
      }
      turn(T, T + 3, c, s);
    }
    if (frame.motion) {
      Lane M[kPoseNumbers];
      for (int k = 0; k < kPoseNumbers; ++k) load(M[k], frame.motion + k * stride + row);
      move(T, M);
    }
    if (frame.kept) {
      for (int k = 0; k < kPoseNumbers; ++k) store(out + k * kGroup, T[k]);
    }
  }
}

template <int W>
FASTCAL_INLINE void forward_lanes(const FrameRows* frames, int frame_count, int stride, double* poses) {
  for (int row = 0; row < stride; row += W) {
    double* out = poses + row / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    typename Vectors<W>::Mask large{};
    forward_group<W, false>(frames, frame_count, stride, row, out, large);
    bool any = false;
    for (int l = 0; l < W; ++l) any |= large[l] != 0;
    if (any) forward_group<W, true>(frames, frame_count, stride, row, out, large);
  }
}

/// The same for every set: rows of a matrix of four are as wide as four lanes.
template <int>
FASTCAL_INLINE void matrices_of(const double* poses, int frame, int frame_count, int rows, double* matrices) {
  for (int row = 0; row < rows; row += 4) {
    const double* part = poses + (row / kGroup * frame_count + frame) * kPoseNumbers * kGroup + row % kGroup;
    for (int r = 0; r < 4; ++r) {
      Vectors<4>::Lane lanes[4] = {{}, {}, {}, {1, 1, 1, 1}};
      for (int c = 0; r < 3 && c < 4; ++c) load(lanes[c], part + (3 * c + r) * kGroup);
      transpose(lanes);
      for (int l = 0; l < 4 && row + l < rows; ++l) store(matrices + 16 * (row + l) + 4 * r, lanes[l]);
    }
  }
}

/// Eight rows of four columns at a time, so that each line of memory is read once.
template <int>
FASTCAL_INLINE void rows_of(const double* columns, int stride, int numbers, int count, int rows, double* matrices) {
  const auto column = [&](int k, int n) { return columns + (static_cast<long>(k) * numbers + n) * stride; };
  const auto to = [&](int row, int n) { return matrices + (static_cast<long>(row) * numbers + n) * count; };
  for (int first = 0; first < rows; first += kGroup) {
    const int last = first + kGroup < rows ? first + kGroup : rows;
    for (int n = 0; n < numbers; ++n) {
      int k = 0;
      for (; k + 4 <= count; k += 4) {
        for (int row = first; row < last; row += 4) {
          Vectors<4>::Lane lanes[4];
          for (int c = 0; c < 4; ++c) load(lanes[c], column(k + c, n) + row);
          transpose(lanes);
          for (int l = 0; l < 4 && row + l < last; ++l) store(to(row + l, n) + k, lanes[l]);
        }
      }
      for (; k < count; ++k) {
        for (int row = first; row < last; ++row) to(row, n)[k] = column(k, n)[row];
      }
    }
  }
}

/// What unit twists of one frame do to the numbers of W rows.
template <int W, int Fixed>
struct Units {
  using Lane = typename Vectors<W>::Lane;
  Lane by[6][kNumbers];

  /// What the three turns of a frame do to a point: its axes crossed with the way to the point.
  static FASTCAL_INLINE void turns(const Lane* T, const Lane* point, Lane (&across)[9]) {
    Lane lever[3];
    for (int r = 0; r < 3; ++r) lever[r] = point[r] - T[9 + r];
    for (int k = 0; k < 3; ++k) {
      const Lane* z = T + 3 * k;
      across[3 * k] = z[1] * lever[2] - z[2] * lever[1];
      across[3 * k + 1] = z[2] * lever[0] - z[0] * lever[2];
      across[3 * k + 2] = z[0] * lever[1] - z[1] * lever[0];
    }
  }

  /// T: the pose of the twist's frame; poses of all frames of these rows from `from` on.
  FASTCAL_INLINE void of(const Lane* T, int first_moved, const double* from, int tool_frame, const NumberRows& numbers,
                         int stride, int row) {
    Lane point[3], across[9], factor, slope[6];
    int seen = tool_frame;  // the frame that `across` is of
    for (int r = 0; r < 3; ++r) load(point[r], from + (tool_frame * kPoseNumbers + 9 + r) * kGroup);
    turns(T, point, across);
    int n = 0;
    for (; n < 3 && (Fixed || numbers.position); ++n) {
      load(factor, numbers.factor + n * stride + row);
      for (int k = 0; k < 3; ++k) {
        by[k][n] = factor * T[3 * k + n];
        by[3 + k][n] = factor * across[3 * k + n];
      }
    }
    for (int s = 0; !Fixed && s < numbers.sight_count; ++s) {
      const Sight& sight = numbers.sights[s];
      n = sight.number;
      if (s == 0 || numbers.sights[s - 1].number != n) {
        for (auto& numbers_by : by) numbers_by[n] = Lane{};
      }
      if (sight.frame < first_moved) continue;
      if (sight.frame != seen) {
        seen = sight.frame;
        for (int r = 0; r < 3; ++r) load(point[r], from + (seen * kPoseNumbers + 9 + r) * kGroup);
        turns(T, point, across);
      }
      load(factor, numbers.factor + n * stride + row);
      for (int k = 0; k < 6; ++k) {
        load(slope[k], sight.slope + k * stride + row);
        slope[k] *= factor;
      }
      for (int k = 0; k < 3; ++k) {
        const Lane *z = T + 3 * k, *x = across + 3 * k;
        by[k][n] += slope[0] * z[0] + slope[1] * z[1] + slope[2] * z[2];
        by[3 + k][n] +=
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
  bool inside = false;  // does a number look at another frame than the tool?
  for (int s = 0; !Fixed && s < numbers.sight_count; ++s) inside |= numbers.sights[s].frame != frame_count - 1;
  for (int row = 0; row < stride; row += W) {
    const double* from = poses + row / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    Lane T[kPoseNumbers];
    Units<W, Fixed> units;
    for (int t = 0; t < twist_count; ++t) {
      const TwistRows& twist = twists[t];
      if (t == 0 || twist.frame != twists[t - 1].frame || (inside && twist.first_moved != twists[t - 1].first_moved)) {
        for (int k = 0; k < kPoseNumbers; ++k) {
          if (twist.frame < 0)
            T[k] = Lane{} + (k == 0 || k == 4 || k == 8 ? 1.0 : 0.0);
          else
            load(T[k], from + (twist.frame * kPoseNumbers + k) * kGroup);
        }
        units.of(T, twist.first_moved, from, frame_count - 1, numbers, stride, row);
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
FASTCAL_FOR_EACH_SET(matrices, matrices_of, (const double* poses, int frame, int n, int rows, double* out),
                     (poses, frame, n, rows, out))
FASTCAL_FOR_EACH_SET(transposed, rows_of,
                     (const double* columns, int stride, int numbers, int count, int rows, double* out),
                     (columns, stride, numbers, count, rows, out))

}  // namespace

void forward_rows(const FrameRows* frames, int frame_count, int stride, double* poses) {
  static const auto run = FASTCAL_BEST_SET(forward);
  run(frames, frame_count, stride, poses);
}

void write_matrices(const double* poses, int frame, int frame_count, int rows, double* matrices) {
  static const auto run = FASTCAL_BEST_SET(matrices);
  run(poses, frame, frame_count, rows, matrices);
}

void write_rows(const double* columns, int stride, int numbers, int count, int rows, double* matrices) {
  static const auto run = FASTCAL_BEST_SET(transposed);
  run(columns, stride, numbers, count, rows, matrices);
}

void twist_columns(const double* poses, int frame_count, int stride, const TwistRows* twists, int twist_count,
                   const NumberRows& numbers) {
  static const auto run = FASTCAL_BEST_SET(columns);
  run(poses, frame_count, stride, twists, twist_count, numbers);
}

}  // namespace fastcal::kernels
