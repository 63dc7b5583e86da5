// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What RowEvaluator does row by row, for a chunk of rows side by side: effects are asked row by row, the chain and the
// columns of its Jacobian are one kernel's work.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "fastcal/math/aligned_numbers.hpp"
#include "fastcal/model/error_model.hpp"
#include "fastcal/model/gathered_twists.hpp"
#include "fastcal/model/loop_block.hpp"
#include "fastcal/model/spring_block.hpp"
#include "fastcal/model/twist_memory.hpp"

namespace fastcal {

/// Evaluates an ErrorModel at one parameter vector; one a thread.
class RowBlock {
 public:
  /// Whose poses forward() keeps: jacobian() needs those of all frames, write_tool() and write_jacobian() none.
  enum class Frames { kAll, kTool, kNone };

  /// `free`: the parameters whose columns are wanted, `scale` by what each is multiplied. With `springs`
  /// (ErrorModel::springs) forward() brings the arm to equilibrium; null: effects find their loads in the samples.
  RowBlock(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, const std::vector<int>& free,
           const Eigen::VectorXd& scale, Frames kept = Frames::kAll, const JointSprings* springs = nullptr);
  RowBlock(const RowBlock&) = delete;
  RowBlock& operator=(const RowBlock&) = delete;

  /// Brings the frames of rows begin ... end - 1 up to date. `memory` (or null) knows these rows, a chunk, from before.
  void forward(const Samples& samples, Eigen::Index begin, Eigen::Index end, TwistMemory* memory);
  /// Did forward() find the equilibrium of every row? Where it did not, settle() has other ways.
  bool settled() const { return settled_; }

  /// Rows of every array, a multiple of kernels::kGroup.
  int stride() const { return stride_; }
  /// Part k of the position of an arm's tool in row i of the block.
  double position(int i, int k) const { return pose_part(frame_count() - 1, i, 9 + k); }
  /// Pose of a frame in row i of the block.
  Pose frame(int frame, int i) const;
  /// Poses T_sensor_target in all rows as 4 x 4 matrices in C order.
  void write_seen(const View& view, double* out);

  /// Columns of `free` in `block`, `ld` apart: d number / d parameter by factor and scale, (numbers, stride) each; 0
  /// for parameters that are not the model's.
  void jacobian(const kernels::NumberRows& numbers, double* block, int ld);
  /// A frame's Jacobian in all rows, (rows, numbers, free) in C order.
  void write_jacobian(int of, kernels::ToolNumbers numbers, bool past_caches, double* out);

 private:
  int frame_count() const { return chain_.frame_count(); }
  double pose_part(int frame, int i, int k) const { return pose_parts(frame, i)[k * kernels::kGroup]; }
  /// Part 0; the others follow kernels::kGroup apart.
  const double* pose_parts(int frame, int i) const {
    const int place = i / kernels::kGroup * kept_count() + kept_count() - (frame_count() - frame);
    return poses_.data() + place * kernels::kPoseNumbers * kernels::kGroup + i % kernels::kGroup;
  }
  /// The last so many frames are kept; of a tree all or none.
  int kept_count() const {
    if (kept_ == Frames::kNone) return 0;
    return kept_ == Frames::kAll || !chain_.is_serial() ? frame_count() : 1;
  }
  /// The tables of these rows, and the sums of the twists by frame. With `sums`, when nobody wants the columns, the
  /// others are asked for their twists alone, and so are linear effects of many columns.
  void evaluate_linear_effects(const Samples& samples, Eigen::Index begin, TwistMemory* memory, bool sums);
  void ask_others(const Samples& samples, Eigen::Index begin, bool sums);
  /// Sum of the twists of a frame, (6, stride), of which the last, the turn about z, may be added to; marks it as
  /// moved.
  double* move(int frame);
  /// The same where all six may be.
  double* tilt(int frame);
  Vector6d frame_twist(int frame, int i) const {
    return Eigen::Map<const Vector6d, 0, Eigen::InnerStride<>>(frame_xi_[static_cast<std::size_t>(frame)].data() + i,
                                                               Eigen::InnerStride<>(stride_));
  }
  /// The steps of the chain, with the ends of the last `kept` frames; of a tree, the runs they make.
  void find_steps(int kept);
  /// The steps from the measuring frame to a frame alone, without ends.
  void find_steps_to(int frame);
  /// Poses (groups, frames, kPoseNumbers, kGroup) of rows first ... last - 1 by the present steps.
  void find_poses(int first, int last, double* poses) const;
  /// The steps of the chain, with the ends of all frames, of which those are unseen that no twist looks at, but `of`.
  void find_steps_of_twists(int of);
  /// The joints' positions in these rows, joint by joint.
  void read_joints(const Samples& samples, Eigen::Index begin);
  /// exp of the twists of a frame that does not only turn about z.
  void general_motion(int frame);
  /// Puts the right Jacobian before the twists of a frame: exp(xi + d) = exp(xi) exp(J_r d), exact at any size.
  void rotate_twists(int frame, std::vector<kernels::TwistRows*>& twists);
  /// Null where the column of a parameter is not wanted.
  kernels::TwistRows* add_twist(int parameter, int frame, int first_moved, std::vector<kernels::TwistRows>& to) const;
  /// Leaves out the twists that do not move a frame.
  void keep_twists_of(int frame, std::vector<kernels::TwistRows>& twists) const;
  /// The twists of the geometry; only those that move frame `of`, or all.
  void set_geometry(int of);
  /// The twists of which the columns of `free` are sums in these rows; of effects only those that move frame `of`, or
  /// all.
  void find_twists(int of);
  /// Passive joints where the loops close.
  void close_loops();
  /// jacobian() with the columns of the passive joints behind the others, these held.
  void open_jacobian(const kernels::NumberRows& numbers, double* block, int ld);
  /// write_jacobian() of a robot with loops.
  void write_closed_jacobian(int of, int numbers, double* out);
  /// Columns of the loops' equations by the twists of effects about joints and along rods that the equations name.
  void add_turns(double* equations, int ld) const;
  int column_count() const { return static_cast<int>(free_count_) + (loops_ ? loops_->passive_count() : 0); }
  /// Zeros for the columns that no twist is part of.
  void clear_unmoved(double* block, Eigen::Index ld) const;

  Eigen::VectorXd theta_;
  Frames kept_;
  Chain chain_;
  std::vector<std::pair<int, double>> wanted_;  // of a parameter: its column (-1: not wanted) and scale
  std::size_t free_count_;
  int stride_ = 0;
  int rows_ = 0;
  std::vector<std::pair<const LinearEffect*, int>> linear_;  // with the places of their first parameters
  std::vector<std::pair<const LinearEffect*, int>> by_row_;  // of them, those that are asked row by row
  std::vector<std::pair<const Effect*, int>> others_;
  Twists xi_;
  TwistColumns columns_;
  TwistTable own_table_, other_table_;
  const TwistTable* table_ = &own_table_;  // of the linear effects
  std::vector<bool> moved_, tilted_;       // by frame, then by loop
  std::vector<AlignedNumbers> frame_xi_;   // by frame, then by loop: (6, stride)
  std::vector<AlignedNumbers> angle_;      // by frame: angle, shift, sine, cosine
  std::vector<AlignedNumbers> motion_;     // by frame: (12, stride)

  AlignedNumbers joints_;  // (joints, stride)
  std::vector<kernels::FrameRows> frames_;
  std::vector<kernels::ChainStep> steps_;
  int step_count_ = 0;
  std::vector<kernels::StepRun> runs_;  // of a tree
  std::optional<SpringBlock> springs_;
  std::optional<LoopBlock> loops_;
  AlignedNumbers open_, equations_;  // columns with those of passive joints; of the loops' equations
  bool settled_ = true;
  std::vector<AlignedNumbers> turned_;                 // twists behind their right Jacobians, (6, stride)
  std::vector<kernels::TwistRows> geometry_, moving_;  // the same in all rows; of effects in these
  GatheredTwists gathered_;                            // both
  int geometry_of_ = kWorldFrame;                      // geometry_ has only the twists that move this frame; else all
  bool gathered_alike_ = false;                        // these are as wherever no effect moves a frame
  std::vector<bool> unmoved_, unmoved_here_;           // by column: no twist of the geometry, no twist is part of it
  AlignedNumbers poses_;
  AlignedNumbers group_;  // for write_jacobian()
};

}  // namespace fastcal
