// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How an arm's beams bend, as its chain sees it: from the state of a row to small twists on frames. structure/ makes
// one of elements and knows no effect; settle() fills State::bending with it, and an effect reads it from there.
//   xi_f = sum_g s_g B_fg(s),   s_g: factor on the compliance of a group of elements; 0: rigid, 1: as modelled.
// Displacements grow with all compliances together, u(c s) = c u(s), so with B_fg = d xi_f / d s_g the sum is xi_f
// itself (Euler), and B is its derivative as well.
#pragma once

#include <string>
#include <vector>

#include "fastcal/robot/state.hpp"

namespace fastcal {

class ArmBending {
 public:
  ArmBending() = default;
  ArmBending(const ArmBending&) = delete;
  ArmBending& operator=(const ArmBending&) = delete;
  virtual ~ArmBending() = default;

  /// Names of the groups of elements, at least one.
  virtual const std::vector<std::string>& groups() const = 0;

  /// Frames of the chain that the beams move, ascending.
  virtual const std::vector<int>& frames() const = 0;

  /// B (frames, groups, 6), body twists [m; rad], at factors `scale` (groups, above 0). Of the state it looks at q,
  /// frames, chain, gravity, payload_load and weights.
  virtual void basis(const RobotDescription& robot, const State& state, const double* scale, double* B) const = 0;

  int width() const { return static_cast<int>(frames().size() * groups().size()) * 6; }
};

}  // namespace fastcal
