// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows that need not be in memory at once: every pass over them reads them part by part.
#pragma once

#include <memory>
#include <vector>

#include "fastcal/measurement/measurements.hpp"
#include "fastcal/robot/state.hpp"

namespace fastcal {

/// Some of the rows: their conditions and what was measured in them.
struct SomeRows {
  std::shared_ptr<const Samples> samples;
  std::shared_ptr<const Measurements> measured;
};

/// All rows, wherever they are. What it reads has the same observations with the same unknowns each time.
class RowSource {
 public:
  RowSource() = default;
  RowSource(const RowSource&) = delete;
  RowSource& operator=(const RowSource&) = delete;
  virtual ~RowSource() = default;

  virtual Eigen::Index count() const = 0;
  /// Rows begin ... end - 1.
  virtual SomeRows read(Eigen::Index begin, Eigen::Index end) const = 0;
  /// Rows in ascending order.
  virtual SomeRows pick(const std::vector<Eigen::Index>& rows) const = 0;
};

}  // namespace fastcal
