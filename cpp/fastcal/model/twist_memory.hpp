// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A memory of the derivatives of linear effects, which stay as long as the states do.
#pragma once

#include <vector>

#include "fastcal/effects/twist_table.hpp"

namespace fastcal {

/// Tables of all chunks of rows that are always the same; one thread a chunk.
class TwistMemory {
 public:
  struct Chunk {
    bool known = false;
    TwistTable table;
  };

  /// Makes place for as many rows, before threads ask for chunks.
  void prepare(Eigen::Index rows);
  /// The chunk that begins at this row.
  Chunk& chunk(Eigen::Index first_row);
  void forget() { chunks_.clear(); }

  /// Is there room for tables of that size for all rows?
  static bool has_room(std::size_t bytes, Eigen::Index rows);

 private:
  std::vector<Chunk> chunks_;
};

}  // namespace fastcal
