// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The chain in many postures side by side: poses of its frames, and what small twists of them do to measured numbers.
// Plain arrays only, compiled for the instruction sets chosen from at run time. Rows come in groups of kGroup; arrays
// "by row" are `stride` long, a multiple of kGroup, whose tail beyond the rows is computed, finite and unheard.
#pragma once

namespace fastcal::kernels {

constexpr int kGroup = 8;
constexpr int kPoseNumbers = 12;  // a rotation, column by column, and a position
constexpr int kNumbers = 32;      // that a row may hold at most

/// What a rotation does, so that its zeros and ones cost nothing.
enum class Turn { kNone, kAboutX, kAboutZ, kAny };

/// T_f = T_(f-1) C Tz(slide) Rz(turn) M; each of the last three by row, null where there is none.
struct FrameRows {
  double constant[kPoseNumbers];  ///< C
  Turn constant_turn;             ///< what its rotation is
  bool kept;                      ///< its pose is wanted
  const double* slide;            ///< [m]
  const double* turn;             ///< [rad]
  const double* motion;           ///< (kPoseNumbers, stride)
};

/// Poses of the frames: (stride / kGroup, frames, kPoseNumbers, kGroup).
void forward_rows(const FrameRows* frames, int frame_count, int stride, double* poses);

/// Poses of one frame in `rows` rows, as forward_rows() left them, as 4 x 4 matrices in C order.
void write_matrices(const double* poses, int frame, int frame_count, int rows, double* matrices);

/// One parameter's twist in the axes of one frame.
struct TwistRows {
  int frame;              ///< -1: the measuring frame
  int first_moved;        ///< the frame itself where the twist is its own, the next where it is behind it
  double scale;           ///< the column is scale times the derivative
  double xi[6];           ///< [v; w], the same in all rows
  const double* part[6];  ///< by row, instead of xi; null: as xi says
  double* column;         ///< (numbers, stride): what it does to each number
  bool adds;              ///< to what is there
};

/// How a number depends on a frame that it looks at.
struct Sight {
  int number;
  int frame;
  const double* slope;  ///< (6, stride) d number / d [v; w] of the frame's origin, axes of the measuring frame
};

/// What was measured: three coordinates of the tool or none, then `others`, each with one sight or more.
struct NumberRows {
  bool position;
  int others;
  const double* factor;  ///< (numbers, stride) by which each number is multiplied
  const Sight* sights;   ///< in the order of their numbers
  int sight_count;
};

/// Columns of the Jacobian; `twists` in the order of their frames.
void twist_columns(const double* poses, int frame_count, int stride, const TwistRows* twists, int twist_count,
                   const NumberRows& numbers);

/// Columns (count, numbers, stride) as matrices (rows, numbers, count) in C order.
void write_rows(const double* columns, int stride, int numbers, int count, int rows, double* matrices);

}  // namespace fastcal::kernels
