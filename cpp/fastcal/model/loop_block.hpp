// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Closed loops of the rows of a RowBlock: their passive joints, and the columns of the Jacobian without these:
//   dr -= dr/dq_p (dc/dq_p)^-1 dc,  c the loops' equations.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/math/aligned_numbers.hpp"
#include "fastcal/robot/assembly.hpp"

namespace fastcal {

class LoopBlock {
 public:
  explicit LoopBlock(const Chain& chain);

  int passive_count() const { return static_cast<int>(chain_.passive.size()); }

  /// Moves the passive joints of `rows` rows of `joints` (n, stride) until the loops close. `twists(i)`: what effects
  /// add to the frames of row i, null where no effect moves a frame.
  void close(double* joints, int rows, int stride, const std::function<const Twists*(int)>& twists);

  /// The twists of the passive joints, in columns `first_column` and on.
  void add_twists(int first_column, std::vector<kernels::TwistRows>& to) const;

  /// The equations as numbers of a Jacobian; lives until the next close().
  kernels::NumberRows numbers() const;

  /// Of parameters by their place in the model, a column and what it is multiplied by; column -1: not wanted.
  using Wanted = std::vector<std::pair<int, double>>;
  /// Adds to the equations' columns what the frames do not say: the loops' own constants, and equations between turns
  /// by passive joints, whose columns begin at `first_passive`.
  void add_own(const Wanted& wanted, int first_passive, double* columns, int ld) const;
  /// Adds `scale` times the turn `by` (stride) of a joint, a parameter's, to a column.
  void add_turn(int joint, double scale, const double* by, double* column) const;
  /// The same of how much longer (stride) a rod is, by its column of Twists.
  void add_rod(int rod, double scale, const double* by, double* column) const;

  /// Takes the passive joints out of the first `count` columns of `block`, `numbers` numbers each: its last columns and
  /// those of `equations` are theirs.
  void eliminate(int count, int numbers, double* block, int ld, double* equations, int equations_ld) const;

 private:
  const Chain& chain_;
  Assembler assembler_;
  int rows_ = 0, stride_ = 0;
  std::vector<std::vector<LoopRow>> equations_;  // by row
  AlignedNumbers slopes_;                        // (equations, 2, 6, stride)
  AlignedNumbers along_;                         // (passive, 6, stride)
  AlignedNumbers ones_;
  std::vector<kernels::Sight> sights_;
};

}  // namespace fastcal
