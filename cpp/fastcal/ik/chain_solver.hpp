// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A chain without effects, brought to many targets: the Chain in the kernel's plain arrays, lengths over the reach.
#pragma once

#include <span>
#include <vector>

#include "fastcal/ik/bounded_step.hpp"
#include "fastcal/ik/chain_kernel.hpp"

namespace fastcal {

/// What ChainSolver found for a target.
struct ChainSolution {
  JointVector q;  ///< [rad, m] the solution, or the best that was met
  bool reached = false;
  double position_error = 0;        ///< [m]
  double rotation_error = 0;        ///< [rad] 2 sin of half the angle
  double least_singular_value = 0;  ///< or less, lengths over the reach
  int evaluations = 0;
};

struct ChainSettings {
  double reach = 1;                                             ///< [m]
  double tolerance_position = 1e-9, tolerance_rotation = 1e-9;  ///< [m], [rad]
  std::uint64_t random_seed = 0;
  std::vector<bool> held = {};  ///< (n) joints that stay where the seed has them; empty: none
};

class ChainSolver {
 public:
  ChainSolver(const Chain& chain, const JointLimits& limits, const ChainSettings& settings);

  /// Solves targets[i] from seeds[i]; rows[i] chooses the postures of its restarts. An attempt that is stuck within an
  /// error of `close` (in units of the kernel) of its target ends the search: near a singular posture the kernel's
  /// squares drown the last steps, and bounded_step() has to take them.
  std::vector<ChainSolution> solve(std::span<const Eigen::Index> rows, std::span<const Pose> targets,
                                   std::span<const JointVector> seeds, int restarts, double close = 0) const;

  /// Posture k of a row's quasi-random sequence.
  JointVector restart(Eigen::Index row, int k) const;

 private:
  ik::ChainPlan plan_{};
  JointLimits limits_;
  Pose T_start_world_;  ///< from the measuring frame to where joint 1 begins
  double reach_;
  std::vector<double> unit_;  ///< (n) [rad, m] one of the kernel's
};

}  // namespace fastcal
