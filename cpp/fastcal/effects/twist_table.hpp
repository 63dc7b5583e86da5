// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Derivatives of frame twists by the parameters of effects: of one row as a list, of a chunk of rows side by side.
#pragma once

#include <array>
#include <vector>

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// Derivatives of frame twists: d xi_frame / d theta_parameter, a list of the few that are not zero.
using TwistColumns = std::vector<Chain::Column>;

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
  /// What `parameter` counts from in what follows.
  void count_from(int first) { first_ = first; }
  /// Adds the columns of one row.
  void add(const TwistColumns& columns, int row);
  /// Part k of the twist, one number a row, to add to; until the next call.
  double* part(int parameter, int frame, int k);

  const std::vector<Entry>& entries() const { return entries_; }
  std::size_t bytes() const;

 private:
  /// `at`: where the entry is likely to be.
  std::size_t find(int parameter, int frame, std::size_t at);
  double* rows(Entry& entry, std::size_t k) const;

  int stride_ = 0;
  int first_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace fastcal
