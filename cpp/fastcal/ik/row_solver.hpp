// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// From a posture to one that brings the tool of a model, effects included, to a target: a row at a time, or many rows
// together while all goes well.
#pragma once

#include <vector>

#include "fastcal/ik/chain_solver.hpp"
#include "fastcal/ik/inverse_kinematics.hpp"
#include "fastcal/ik/model_frames.hpp"
#include "fastcal/ik/pose_search.hpp"

namespace fastcal {

/// What is known of a row once its chain is solved.
struct IkRow {
  Eigen::Index index = 0;
  Pose target;
  JointVector seed;
  Pose of_chain;  ///< the target as the arm without effects sees it: from its own base, with its own tool
  ChainSolution chain;
  SearchPoint model;  ///< where the model is, as far as approach() brought it
};

/// A 4 x 4 pose in C order as the nearest one that is exactly a rotation; false where it is none, or not finite.
bool to_target(const double* numbers, Pose& target);

class RowSolver {
 public:
  /// All three outlive the solver.
  RowSolver(const ErrorModel& model, const Eigen::VectorXd& theta, const IkOptions& options);

  /// The chain without effects, of all rows side by side.
  void solve_chain(std::vector<IkRow>& rows, ModelFrames& frames, int restarts) const;

  /// Takes the rows together from the chain's solution to the model's, as long as every step helps much: the Jacobian
  /// is the chain's in the deflected posture, so what is left of the error is the share by which the deflection
  /// changes.
  void approach(std::vector<IkRow>& rows, const Samples& samples) const;

  /// The end of one row, from what the other two made of it: its status, and where it is.
  IkStatus finish(const IkRow& row, ModelFrames& frames, bool may_jump, SearchPoint& best) const;

 private:
  class TreeSearch;

  Goal goal_of(const IkRow& row) const;
  /// finish() of an arm that branches or has loops: no chain goes ahead, other postures are tried by luck.
  IkStatus finish_tree(const IkRow& row, ModelFrames& frames, bool may_jump, SearchPoint& best) const;
  /// The row's target less what its effects make of base and tool at the seed, such as another station or mount.
  Pose seen_by_chain(const IkRow& row, ModelFrames& frames) const;
  bool is_held(Eigen::Index joint) const;
  /// The limits, of joints that are held the seed (as far as the limits have it).
  JointLimits held_at(const JointVector& seed, const JointLimits& limits) const;
  /// search_pose; where that creeps along the postures of a nearly singular arm, by walk_singular.
  SearchPoint search(const FramesAt& frames_at, const Goal& goal, const JointLimits& limits, const JointVector& from,
                     int max_evaluations) const;
  /// Is the chain at a solution or stuck next to one?
  bool is_close(const ChainSolution& found) const;
  /// The least singular value below which a posture with these errors [m], [rad] may be that of a singular one: where
  /// the arm stretches, the error grows as the square of the distance.
  double near_singular(double position_error, double rotation_error) const;
  /// Is the posture singular, there or where the pose is reached to the last digit?
  bool is_singular(const IkRow& row, const FramesAt& frames_at, const SearchPoint& point) const;
  /// Solutions of the chain alone, or postures next to one, from the first postures of the row's sequence.
  std::vector<JointVector> chain_solutions(const IkRow& row, const JointLimits& limits, int count, int restarts,
                                           int& evaluations) const;
  /// Takes whole turns out of revolute joints, as far as the limits let them come nearer to the seed.
  void unwind(const JointVector& seed, const JointLimits& limits, JointVector& q) const;

  const ErrorModel& model_;
  const Eigen::VectorXd& theta_;
  const IkOptions& options_;
  Chain chain_;
  JointLimits limits_, unlimited_;
  bool bare_;
  bool is_tree_;     // or has loops
  bool moves_ends_;  // have effects moved base or tool?
  ChainSettings settings_;
  ChainSolver within_;  // within the limits
};

}  // namespace fastcal
