// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Derivatives of frame twists by the parameters of effects, for a chunk of rows side by side; and a memory of them,
// since those of linear effects stay as long as the states do.
#pragma once

#include <array>
#include <vector>

#include "fastcal/effects/effect.hpp"

namespace fastcal {

/// d xi_frame / d theta_parameter in every row of a chunk.
class TwistTable {
 public:
  struct Entry {
    int parameter, frame;
    std::array<int, 6> place;    // of each part in `values`; -1: 0 in all rows
    std::vector<double> values;  // (places, stride)

    const double* part(int k, int stride) const {
      const int at = place[static_cast<std::size_t>(k)];
      return at < 0 ? nullptr : values.data() + static_cast<std::ptrdiff_t>(at) * stride;
    }
  };

  void clear(int stride);
  /// Adds the columns of one row.
  void add(const TwistColumns& columns, int row);

  const std::vector<Entry>& entries() const { return entries_; }
  std::size_t bytes() const;

 private:
  int stride_ = 0;
  std::vector<Entry> entries_;
};

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
