// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Where the robot is and where the target sits on it, from the data alone: a closed form, so that no initial guess
// is asked for.
#pragma once

#include <string>

#include "fastcal/identification/problem.hpp"

namespace fastcal {

struct Alignment {
  Pose T_world_base;
  Pose T_flange_tool;
  Eigen::VectorXd unknowns;  ///< of the observations
  double rms =
      0;  ///< [m] what the rigid fit leaves: distances of points, or of lengths and planes where there are no points
  bool found = false;
  std::string message;
};

/// Best rigid fit of base and tool to what was measured; the arm between them stays as it is.
///
/// Positions: p_i = R_b (f_i + R_i t) + p_b with the arm's flange poses (R_i, f_i). In [R_b, R_b (x) t, p_b] this is
/// linear; the solution is projected on rotations and refined. Rows that cannot carry it (few, or turning about one
/// axis) start from the nominal tool instead. Orientations: R_i^w = R_b R_i R_t by the first singular pair of sum R_i^w
/// (x) R_i (M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker product", 2013). Where
/// no row has either the base stays. Unknowns of observations start by their own closed forms. What the data do not
/// show of base or tool stays nominal.
Alignment align(const Problem& problem);

/// Closed-form values of the observations' unknowns for a robot, of one arm or a tree, that is where the model puts it;
/// returns what is missing, in a sentence.
std::string start_unknowns(const Problem& problem, Eigen::VectorXd& unknowns);

}  // namespace fastcal
