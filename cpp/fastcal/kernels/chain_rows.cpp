// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/chain_rows.hpp"

#include "fastcal/kernels/frame_lanes.hpp"
#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lanes.hpp"
#include "fastcal/kernels/tool_columns.hpp"
#include "fastcal/kernels/tool_matrices.hpp"

namespace fastcal::kernels {
namespace {

constexpr double kLargeAngle = 1e5;  // it has lost digits already; the polynomials hold below 1e6

/// Four rows of four columns at a time; the last four columns overlap those before.
template <int W>
FASTCAL_INLINE void table_of(const double* table, int rows, int columns, int stride, double* out, bool& is_finite) {
  Vectors<4>::Lane nothing{};
  double rest = 0;
  int row = 0;
  for (; columns >= 4 && row + 4 <= rows; row += 4) {
    for (int next = 0; next < columns; next += 4) {
      const int k = next + 4 <= columns ? next : columns - 4;
      Vectors<4>::Lane lanes[4];
      for (int l = 0; l < 4; ++l) {
        load(lanes[l], table + static_cast<long>(row + l) * columns + k);
        nothing += 0 * lanes[l];
      }
      transpose(lanes);
      for (int c = 0; c < 4; ++c) store(out + (k + c) * stride + row, lanes[c]);
    }
  }
  for (; row < stride; ++row) {
    for (int k = 0; k < columns; ++k) {
      const double number = row < rows ? table[static_cast<long>(row) * columns + k] : 0;
      rest += 0 * number;
      out[k * stride + row] = number;
    }
  }
  for (int l = 0; l < 4; ++l) rest += nothing[l];
  is_finite = rest == 0;
}

template <int W>
FASTCAL_INLINE void sines_of(const double* angle, int stride, double* sine_cosine) {
  using Lane = typename Vectors<W>::Lane;
  typename Vectors<W>::Mask large{};
  for (int row = 0; row < stride; row += W) {
    Lane value, s, c;
    load(value, angle + row);
    large |= (typename Vectors<W>::Mask)((value > kLargeAngle) | (value < -kLargeAngle));
    fastcal::kernels::sine_cosine<W>(value, s, c);
    store(sine_cosine + row, s);
    store(sine_cosine + stride + row, c);
  }
  bool any = false;
  for (int l = 0; l < W; ++l) any |= large[l] != 0;
  for (int row = 0; any && row < stride; ++row) {
    if (__builtin_fabs(angle[row]) <= kLargeAngle) continue;
    sine_cosine[row] = __builtin_sin(angle[row]);
    sine_cosine[stride + row] = __builtin_cos(angle[row]);
  }
}

template <int W>
FASTCAL_INLINE void forward_lanes(const ChainStep* steps, int step_count, int frame_count, int stride, int first,
                                  int last, double* poses) {
  for (int row = first; row < last; row += W) {
    double* out = poses + (row - first) / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    typename Vectors<W>::Lane T[kPoseNumbers];
    identity(T);
    bool is_first = true;
    for (const ChainStep* step = steps; step < steps + step_count; ++step) {
      if (step->kind == ChainStep::Kind::kFrame || step->kind == ChainStep::Kind::kUnseen) {
        for (int k = 0; step->kind == ChainStep::Kind::kFrame && k < kPoseNumbers; ++k) store(out + k * kGroup, T[k]);
        out += kPoseNumbers * kGroup;
      } else if (is_first) {
        take_first(T, *step, stride, row);
        is_first = false;
      } else {
        take(T, *step, stride, row);
      }
    }
  }
}

template <int W>
FASTCAL_INLINE void runs_lanes(const ChainStep* steps, const StepRun* runs, int run_count, int frame_count, int stride,
                               int first, int last, double* poses) {
  for (int row = first; row < last; row += W) {
    double* from = poses + (row - first) / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    for (const StepRun* run = runs; run < runs + run_count; ++run) {
      typename Vectors<W>::Lane T[kPoseNumbers];
      identity(T);
      for (int k = 0; run->parent >= 0 && k < kPoseNumbers; ++k)
        load(T[k], from + (run->parent * kPoseNumbers + k) * kGroup);
      double* out = from + run->first_frame * kPoseNumbers * kGroup;
      for (const ChainStep* step = steps + run->first_step; step < steps + run->last_step; ++step) {
        if (step->kind != ChainStep::Kind::kFrame) {
          take(T, *step, stride, row);
          continue;
        }
        for (int k = 0; k < kPoseNumbers; ++k) store(out + k * kGroup, T[k]);
        out += kPoseNumbers * kGroup;
      }
    }
  }
}

/// Rows of a matrix of four are as wide as four lanes, in every set.
template <int W>
FASTCAL_INLINE void matrices_of(const ChainStep* steps, int step_count, int stride, int rows, double* matrices) {
  for (int row = 0; row < rows; row += W) {
    typename Vectors<W>::Lane T[kPoseNumbers];
    identity(T);
    if (step_count > 0) take_first(T, *steps, stride, row);
    for (const ChainStep* step = steps + 1; step < steps + step_count; ++step) take(T, *step, stride, row);
    double numbers[kPoseNumbers * W];
    for (int k = 0; k < kPoseNumbers; ++k) store(numbers + k * W, T[k]);
    for (int first = 0; first < W; first += 4) {
      for (int r = 0; r < 4; ++r) {
        Vectors<4>::Lane lanes[4] = {{}, {}, {}, {1, 1, 1, 1}};
        for (int c = 0; r < 3 && c < 4; ++c) load(lanes[c], numbers + (3 * c + r) * W + first);
        transpose(lanes);
        for (int l = 0; l < 4 && row + first + l < rows; ++l)
          store(matrices + 16 * (row + first + l) + 4 * r, lanes[l]);
      }
    }
  }
}

/// What unit twists of one frame do to the numbers of W rows.
template <int W>
struct Units {
  using Lane = typename Vectors<W>::Lane;
  Lane by[6][kNumbers];

  /// What the three turns of a frame do to a point: its axes crossed with the way to the point.
  static FASTCAL_INLINE void turns(const Lane* T, const Lane* point, Lane (&across)[9]) {
    Lane lever[3];
    for (int r = 0; r < 3; ++r) lever[r] = point[r] - T[9 + r];
    for (int k = 0; k < 3; ++k) cross(T + 3 * k, lever, across + 3 * k);
  }

  /// T: the pose of the twist's frame; poses of all frames of these rows from `from` on.
  FASTCAL_INLINE void of(const Lane* T, int first_moved, int end_moved, const double* from, int tool_frame,
                         const NumberRows& numbers, int stride, int row) {
    Lane point[3], across[9], factor, slope[6];
    int seen = tool_frame;  // the frame that `across` is of
    for (int r = 0; r < 3; ++r) load(point[r], from + (tool_frame * kPoseNumbers + 9 + r) * kGroup);
    turns(T, point, across);
    int n = 0;
    for (; n < static_cast<int>(numbers.tool); ++n) {
      load(factor, numbers.factor + n * stride + row);
      for (int k = 0; k < 3; ++k) {
        by[k][n] = factor * T[3 * k + n];
        by[3 + k][n] = factor * across[3 * k + n];
      }
    }
    for (int s = 0; s < numbers.sight_count; ++s) {
      const Sight& sight = numbers.sights[s];
      n = sight.number;
      if (s == 0 || numbers.sights[s - 1].number != n) {
        for (auto& numbers_by : by) numbers_by[n] = Lane{};
      }
      if (sight.frame < first_moved || sight.frame >= end_moved) continue;
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

  FASTCAL_INLINE void write(const FrameTwists::Unit& unit, int k, int count, int stride, double* column) const {
    for (int n = 0; n < count; ++n) store(column + n * stride, unit.size * by[k][n]);
  }

  FASTCAL_INLINE void write(const TwistRows& twist, int count, int stride, int row, double* column) const {
    Lane sum[kNumbers], part = {};
    for (int n = 0; n < count; ++n) {
      sum[n] = Lane{};
      if (twist.adds) load(sum[n], column + n * stride);
    }
    for (int u = 0; u < twist.term_count; ++u) {
      const TwistTerm& term = twist.terms[u];
      size_of(term, twist.scale, row, part);
      for (int n = 0; n < count; ++n) sum[n] += part * by[3 * term.turns + term.axis][n];
    }
    for (int n = 0; n < count; ++n) store(column + n * stride, sum[n]);
  }
};

template <int W>
FASTCAL_INLINE void columns_lanes(const double* poses, int frame_count, int stride, const FrameTwists* twists,
                                  int twist_count, const NumberRows& numbers, double* columns, int ld) {
  using Lane = typename Vectors<W>::Lane;
  const int count = static_cast<int>(numbers.tool) + numbers.others;
  bool inside = false;  // does a number look at another frame than the tool?
  for (int s = 0; s < numbers.sight_count; ++s) inside |= numbers.sights[s].frame != frame_count - 1;
  // In a tree some twists do not move the tool either.
  for (const FrameTwists* of = twists; of < twists + twist_count; ++of) {
    for (const FrameTwists::Unit& unit : of->units) inside |= unit.column >= 0 && unit.end_moved < frame_count;
    for (int t = 0; t < of->other_count; ++t) inside |= of->others[t]->end_moved < frame_count;
  }
  for (int row = 0; row < stride; row += W) {
    const double* from = poses + row / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    const auto column = [columns, ld, row](int k) { return columns + static_cast<long>(k) * ld + row; };
    Lane T[kPoseNumbers];
    Units<W> units;
    for (const FrameTwists* of = twists; of < twists + twist_count; ++of) {
      identity(T);
      for (int k = 0; of->frame >= 0 && k < kPoseNumbers; ++k)
        load(T[k], from + (of->frame * kPoseNumbers + k) * kGroup);
      int first_moved = -1, end_moved = -1;
      const auto look = [&](int first, int end) {
        if (first_moved < 0 || (inside && (first != first_moved || end != end_moved)))
          units.of(T, first, end, from, frame_count - 1, numbers, stride, row);
        first_moved = first;
        end_moved = end;
      };
      for (int k = 0; k < 6; ++k) {
        const FrameTwists::Unit& unit = of->units[k];
        if (unit.column < 0) continue;
        look(unit.first_moved, unit.end_moved);
        units.write(unit, k, count, stride, column(unit.column));
      }
      for (int t = 0; t < of->other_count; ++t) {
        const TwistRows& twist = *of->others[t];
        look(twist.first_moved, twist.end_moved);
        units.write(twist, count, stride, row, column(twist.column));
      }
    }
  }
}

template <int W>
FASTCAL_INLINE void columns_of(const double* poses, int frame_count, int stride, const FrameTwists* twists,
                               int twist_count, const NumberRows& numbers, double* columns, int ld) {
  if (numbers.others > 0 || numbers.tool != ToolNumbers::kPosition)
    return columns_lanes<W>(poses, frame_count, stride, twists, twist_count, numbers, columns, ld);
  for (int row = 0; row < stride; row += W) {
    const double* from = poses + row / kGroup * frame_count * kPoseNumbers * kGroup + row % kGroup;
    tool_columns<W, 3, true>(from, frame_count, twists, twist_count, row, numbers.factor + row, stride, columns + row,
                             ld);
  }
}

template <int W>
FASTCAL_INLINE void jacobians_of(const double* poses, int frame_count, const FrameTwists* twists, int twist_count,
                                 ToolNumbers numbers, int columns, int first, int rows, double* block,
                                 LineStream& out) {
  if (numbers == ToolNumbers::kPose)
    matrices_of_tool<W, 6>(poses, frame_count, twists, twist_count, columns, first, rows, block, out);
  else
    matrices_of_tool<W, 3>(poses, frame_count, twists, twist_count, columns, first, rows, block, out);
}

FASTCAL_FOR_EACH_SET(table, table_of,
                     (const double* table, int rows, int columns, int stride, double* out, bool& is_finite),
                     (table, rows, columns, stride, out, is_finite))
FASTCAL_FOR_EACH_SET(sines, sines_of, (const double* angle, int stride, double* out), (angle, stride, out))
FASTCAL_FOR_EACH_SET(forward, forward_lanes,
                     (const ChainStep* s, int n, int frames, int stride, int first, int last, double* poses),
                     (s, n, frames, stride, first, last, poses))
FASTCAL_FOR_EACH_SET(runs, runs_lanes,
                     (const ChainStep* s, const StepRun* r, int n, int frames, int stride, int first, int last,
                      double* poses),
                     (s, r, n, frames, stride, first, last, poses))
FASTCAL_FOR_EACH_SET(columns, columns_of,
                     (const double* poses, int n, int stride, const FrameTwists* t, int count,
                      const NumberRows& numbers, double* to, int ld),
                     (poses, n, stride, t, count, numbers, to, ld))
FASTCAL_FOR_EACH_SET(jacobians, jacobians_of,
                     (const double* poses, int n, const FrameTwists* t, int count, ToolNumbers numbers, int columns,
                      int first, int rows, double* block, LineStream& out),
                     (poses, n, t, count, numbers, columns, first, rows, block, out))
FASTCAL_FOR_EACH_SET(matrices, matrices_of, (const ChainStep* s, int n, int stride, int rows, double* out),
                     (s, n, stride, rows, out))

}  // namespace

bool read_rows(const double* table, int rows, int columns, int stride, double* out) {
  static const auto run = FASTCAL_BEST_SET(table);
  bool is_finite = true;
  run(table, rows, columns, stride, out, is_finite);
  return is_finite;
}

void sines_and_cosines(const double* angle, int stride, double* sine_cosine) {
  static const auto run = FASTCAL_BEST_SET(sines);
  run(angle, stride, sine_cosine);
}

int steps_of(const FrameRows& frame, ChainStep* steps) {
  using Kind = ChainStep::Kind;
  int count = 0;
  const auto add = [&](const ChainStep& step) { steps[count++] = step; };
  const double* C = frame.constant;
  if (frame.constant_turn == Turn::kAny) {
    add({Kind::kMove, 0, 0, 0, 0, C});
  } else {
    for (int k = 0; k < 3; ++k) {
      if (C[9 + k] != 0) add({Kind::kShift, k, C[9 + k], 0, 0, nullptr});
    }
    if (frame.constant_turn == Turn::kAboutX) add({Kind::kTurnX, 0, 0, C[4], C[5], nullptr});
    if (frame.constant_turn == Turn::kAboutZ) add({Kind::kTurnZ, 0, 0, C[0], C[1], nullptr});
  }
  if (frame.slide) add({Kind::kSlideRows, 0, 0, 0, 0, frame.slide});
  if (frame.turn) add({Kind::kTurnRows, 0, 0, 0, 0, frame.sine_cosine});
  if (frame.motion) add({Kind::kMoveRows, 0, 0, 0, 0, frame.motion});
  add({Kind::kFrame, 0, 0, 0, 0, nullptr});
  return count;
}

void forward_rows(const ChainStep* steps, int step_count, int frame_count, int stride, int first, int last,
                  double* poses) {
  static const auto run = FASTCAL_BEST_SET(forward);
  run(steps, step_count, frame_count, stride, first, last, poses);
}

void forward_runs(const ChainStep* steps, const StepRun* runs, int run_count, int frame_count, int stride, int first,
                  int last, double* poses) {
  static const auto run = FASTCAL_BEST_SET(runs);
  run(steps, runs, run_count, frame_count, stride, first, last, poses);
}

void forward_matrices(const ChainStep* steps, int step_count, int stride, int rows, double* matrices) {
  static const auto run = FASTCAL_BEST_SET(matrices);
  run(steps, step_count, stride, rows, matrices);
}

void twist_columns(const double* poses, int frame_count, int stride, const FrameTwists* twists, int twist_count,
                   const NumberRows& numbers, double* columns, int ld) {
  static const auto run = FASTCAL_BEST_SET(columns);
  run(poses, frame_count, stride, twists, twist_count, numbers, columns, ld);
}

void tool_jacobians(const double* poses, int frame_count, const FrameTwists* twists, int twist_count,
                    ToolNumbers numbers, int columns, int first, int rows, double* block, LineStream& out) {
  static const auto run = FASTCAL_BEST_SET(jacobians);
  run(poses, frame_count, twists, twist_count, numbers, columns, first, rows, block, out);
}

}  // namespace fastcal::kernels
