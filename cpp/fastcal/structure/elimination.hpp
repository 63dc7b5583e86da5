// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The order in which nodes are eliminated and where fill appears, found once from the topology: every posture of a
// frame has the same pattern. Blocks are nodes; greedy minimum degree (W. F. Tinney, J. W. Walker, 1967) eliminates a
// chain from its ends without any fill and a closed loop with the least.
#pragma once

#include <utility>
#include <vector>

namespace fastcal::beam {

/// Blocks of the lower triangle in elimination order: block k < free_count is the diagonal one of position k,
/// block free_count + s is the sub-diagonal one of slot s.
struct Elimination {
  int free_count = 0;
  std::vector<int> position;    ///< (nodes) place in the order, -1 for a node that is held in every direction
  std::vector<int> slot_begin;  ///< (free_count + 1) the slots of column k are slot_begin[k] .. slot_begin[k + 1] - 1
  std::vector<int> slot_row;    ///< (slots) row, ascending within a column
  std::vector<int> update;      ///< for column k and its rows i >= j, in that order: the block (i, j) they change

  int block_count() const { return free_count + static_cast<int>(slot_row.size()); }
  /// The block of rows `row` and columns `column`, positions with row > column; it must be in the pattern.
  int block(int row, int column) const;
};

/// `edges` are pairs of nodes, `held` says which nodes are no unknowns.
Elimination plan_elimination(const std::vector<std::pair<int, int>>& edges, const std::vector<bool>& held);

}  // namespace fastcal::beam
