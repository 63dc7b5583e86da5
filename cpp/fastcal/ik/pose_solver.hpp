// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One pose at a time, for a controller's loop: what does not depend on the pose is made ready once.
#pragma once

#include "fastcal/ik/row_solver.hpp"

namespace fastcal {

class PoseSolver {
 public:
  /// `conditions`: one row; its q does not matter. `along_path` and `threads` of the options are not looked at.
  PoseSolver(ErrorModel model, Samples conditions, IkOptions options);
  PoseSolver(const PoseSolver&) = delete;
  PoseSolver& operator=(const PoseSolver&) = delete;

  int joint_count() const { return model_.robot().joint_count(); }

  /// Joint positions (n) for a target, 4 x 4 in C order, from a seed (n): as a row of inverse_kinematics().
  IkStatus solve(const double* target, const double* seed, SearchPoint& found);

  /// Pose of the tool at joint positions (n), effects included.
  const Pose& forward(const double* q);

 private:
  ErrorModel model_;
  Eigen::VectorXd theta_;
  Samples conditions_;
  IkOptions options_;
  RowSolver solver_;
  ModelFrames frames_;
};

}  // namespace fastcal
