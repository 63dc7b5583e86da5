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
  const double* slide;            ///< [m]
  const double* turn;             ///< [rad]
  const double* sine_cosine;      ///< (2, stride) of the turn
  const double* motion;           ///< (kPoseNumbers, stride)
};

/// The columns (columns, stride) of a table (rows, columns), the tail zero. False where a number is not finite.
bool read_rows(const double* table, int rows, int columns, int stride, double* out);

/// Sines and cosines (2, stride) of angles [rad] of any size. Apart from the chain, whose steps wait for each other.
void sines_and_cosines(const double* angle, int stride, double* sine_cosine);

/// What a frame's pose takes to follow from the one before, step by step, so that zeros and ones cost nothing, and its
/// end: kUnseen where nobody looks at the pose.
struct ChainStep {
  enum class Kind { kShift, kTurnX, kTurnZ, kMove, kSlideRows, kTurnRows, kMoveRows, kFrame, kUnseen };
  Kind kind;
  int axis;             ///< of the shift
  double shift;         ///< [m]
  double cosine, sine;  ///< of the turn about x or z
  const double* rows;   ///< the constant (kPoseNumbers); or by row: a slide, sines and cosines, motions; null: none
};

constexpr int kMostSteps = 8;  // of a frame

/// The steps of one frame, at most kMostSteps, the last of them kFrame; how many.
int steps_of(const FrameRows& frame, ChainStep* steps);

/// Poses of the frames that the steps end in rows first ... last - 1, whole groups: ((last - first) / kGroup, frames,
/// kPoseNumbers, kGroup).
void forward_rows(const ChainStep* steps, int step_count, int frame_count, int stride, int first, int last,
                  double* poses);

/// Poses at the end of the steps in the first `rows` rows as 4 x 4 matrices in C order.
void forward_matrices(const ChainStep* steps, int step_count, int stride, int rows, double* matrices);

/// What of a twist is not zero everywhere: a shift along, or a turn about, one axis of its frame.
struct TwistTerm {
  int axis;
  bool turns;
  double size;         ///< by how much, times the twist's scale
  const double* rows;  ///< or by row, without the scale; null: as `size` says
};

/// One parameter's twist in the axes of one frame.
struct TwistRows {
  /// By 1 along or about one axis; the same in all rows; any. All but the last begin their columns.
  enum class Kind { kShift, kTurn, kFixed, kAny };
  Kind kind;
  int frame;        ///< -1: the measuring frame
  int first_moved;  ///< the frame itself where the twist is its own, the next where it is behind it
  int column;       ///< of the Jacobian
  bool adds;        ///< to what is there
  double scale;     ///< the column is scale times the derivative
  int term_count;
  TwistTerm terms[6];
  double fixed[6];  ///< [v; w] of those that do not differ by row, times the scale
};

/// How a number depends on a frame that it looks at.
struct Sight {
  int number;
  int frame;
  const double* slope;  ///< (6, stride) d number / d [v; w] of the frame's origin, axes of the measuring frame
};

/// What is seen of the tool itself, in the axes of the measuring frame: nothing, its position, or that and its turn.
enum class ToolNumbers { kNone = 0, kPosition = 3, kPose = 6 };

/// What was measured: numbers of the tool, then `others`, each with one sight or more. The tool's pose comes alone and
/// without factors; where there are none, there is one group of rows.
struct NumberRows {
  ToolNumbers tool;
  int others;            ///< none beside kPose
  const double* factor;  ///< (numbers, stride) by which each number is multiplied; null: none is
  const Sight* sights;   ///< in the order of their numbers
  int sight_count;
};

/// Columns of the Jacobian, (numbers, stride) each and `ld` apart; `twists` in the order of their frames.
void twist_columns(const double* poses, int frame_count, int stride, const TwistRows* const* twists, int twist_count,
                   const NumberRows& numbers, double* columns, int ld);

/// Columns (count, numbers, stride) as matrices (rows, numbers, count) in C order.
void write_rows(const double* columns, int stride, int numbers, int count, int rows, double* matrices);

}  // namespace fastcal::kernels
