// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The twists that columns of the Jacobian are sums of, as kernels::twist_columns wants them.
#pragma once

#include <vector>

#include "fastcal/kernels/chain_rows.hpp"

namespace fastcal {

/// Adds part k of [v; w]: `size` in all rows, or by row.
void add_term(int k, double size, const double* rows, kernels::TwistRows& twist);

bool only_turns_about_z(const kernels::TwistRows& twist);

/// By their frames; the first twist of a column begins it, the others add to it.
void put_in_order(std::vector<kernels::TwistRows>& twists, std::vector<bool>& unmoved);

/// Twists by the frame that they are looked at in.
class GatheredTwists {
 public:
  /// Two lists, each in order, for so many columns. They have to outlive what is asked for here. `chain` is as
  /// forward kinematics leaves it.
  void gather(const std::vector<kernels::TwistRows>& geometry, const std::vector<kernels::TwistRows>& moving,
              const std::vector<kernels::FrameRows>& chain, std::size_t columns);
  const std::vector<kernels::FrameTwists>& frames() const { return frames_; }
  int count() const { return static_cast<int>(frames_.size()); }

 private:
  std::vector<const kernels::TwistRows*> others_;  // that the frames point to
  std::vector<kernels::FrameTwists> frames_;
};

}  // namespace fastcal
