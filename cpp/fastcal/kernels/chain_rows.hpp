// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The chain in many postures side by side: poses of its frames, and what small twists of them do to measured numbers.
// Plain arrays only, compiled for the instruction sets chosen from at run time. Rows come in groups of kGroup; arrays
// "by row" are `stride` long, a multiple of kGroup, whose tail beyond the rows is computed, finite and unheard.
#pragma once

namespace fastcal::kernels {

class LineStream;

constexpr int kGroup = 8;
constexpr int kPoseNumbers = 12;     // a rotation, column by column, and a position
constexpr int kNumbers = 32;         // that a row may hold at most
constexpr int kAllBehind = 1 << 30;  // all frames from one on, as in a chain

/// What a rotation does, so that its zeros and ones cost nothing.
enum class Turn { kNone, kAboutX, kAboutZ, kAny };

/// T_f = T_(f-1) C Tz(slide) Rz(turn) M; each of the last three by row, null where there is none. A frame that branches
/// off follows another one than that before it.
struct FrameRows {
  double constant[kPoseNumbers];  ///< C
  Turn constant_turn;             ///< what its rotation is
  const double* slide;            ///< [m]
  const double* turn;             ///< [rad]
  const double* sine_cosine;      ///< (2, stride) of the turn
  const double* motion;           ///< (kPoseNumbers, stride)
  bool branches_off = false;
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

/// Frames that follow each other from `parent` on, whose pose the runs before have found; -1: from the measuring frame.
struct StepRun {
  int parent;
  int first_frame;
  int first_step, last_step;
};

/// forward_rows() of a tree, run by run.
void forward_runs(const ChainStep* steps, const StepRun* runs, int run_count, int frame_count, int stride, int first,
                  int last, double* poses);

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
  int frame;        ///< -1: the measuring frame
  int first_moved;  ///< the frame itself where the twist is its own, the next where it is behind it
  int column;       ///< of the Jacobian
  bool adds;        ///< to what is there; the twists before have begun the column
  double scale;     ///< the column is scale times the derivative
  int term_count;
  TwistTerm terms[6];
  int end_moved = kAllBehind;  ///< one past the last frame moved: frames lie in depth-first order
};

/// The twists of one frame: those along or about one of its axes, the same in all rows, which begin their columns; and
/// the others.
struct FrameTwists {
  struct Unit {
    int column = -1;      ///< -1: there is none
    int first_moved = 0;  ///< as of TwistRows
    double size = 0;
    int end_moved = kAllBehind;
  };
  int frame;      ///< -1: the measuring frame
  Unit units[6];  ///< along x, y, z; about x, y, z
  const TwistRows* const* others;
  int other_count;
};

/// How a number depends on a frame that it looks at.
struct Sight {
  int number;
  int frame;
  const double* slope;  ///< (6, stride) d number / d [v; w] of the frame's origin, axes of the measuring frame
};

/// What is seen of the tool itself, in the axes of the measuring frame: nothing, its position, or that and its turn.
enum class ToolNumbers { kNone = 0, kPosition = 3, kPose = 6 };

/// What was measured: numbers of the tool, none or its position, then `others`, each with one sight or more.
struct NumberRows {
  ToolNumbers tool;
  int others;
  const double* factor;  ///< (numbers, stride) by which each number is multiplied
  const Sight* sights;   ///< in the order of their numbers
  int sight_count;
};

/// Columns of the Jacobian, (numbers, stride) each and `ld` apart; `twists` in the order of their frames. The tool's
/// numbers, of which NumberRows may have some, are those of the last frame.
void twist_columns(const double* poses, int frame_count, int stride, const FrameTwists* twists, int twist_count,
                   const NumberRows& numbers, double* columns, int ld);

/// Jacobians of the tool's numbers, matrices (numbers, columns) in C order, of the first `rows` rows of a group that
/// begins at row `first`; the tool is the last of the `frame_count` frames. `block` has room for a group's columns,
/// zero before the first group and not touched between.
void tool_jacobians(const double* poses, int frame_count, const FrameTwists* twists, int twist_count,
                    ToolNumbers numbers, int columns, int first, int rows, double* block, LineStream& out);

}  // namespace fastcal::kernels
