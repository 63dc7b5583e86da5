// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/twist_table.hpp"

#include <algorithm>

#include "fastcal/math/parallel.hpp"

namespace fastcal {

void TwistTable::clear(int stride) {
  stride_ = stride;
  for (Entry& entry : entries_) {
    entry.place.fill(-1);
    entry.values.clear();
  }
}

void TwistTable::add(const TwistColumns& columns, int row) {
  std::size_t at = 0;  // effects give their columns in the same order in most rows
  for (const Chain::Column& column : columns) {
    const auto same = [&column](const Entry& entry) {
      return entry.parameter == column.parameter && entry.frame == column.frame;
    };
    if (at >= entries_.size() || !same(entries_[at]))
      at = static_cast<std::size_t>(std::find_if(entries_.begin(), entries_.end(), same) - entries_.begin());
    if (at == entries_.size()) entries_.push_back({column.parameter, column.frame, {-1, -1, -1, -1, -1, -1}, {}});
    Entry& entry = entries_[at++];
    const double* xi = column.xi.data();
    for (std::size_t k = 0; k < 6; ++k) {
      if (xi[k] == 0) continue;
      int& place = entry.place[k];
      if (place < 0) {
        place = static_cast<int>(entry.values.size()) / stride_;
        entry.values.resize(entry.values.size() + static_cast<std::size_t>(stride_), 0.0);
      }
      const auto at_row =
          static_cast<std::size_t>(place) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(row);
      entry.values[at_row] += xi[k];
    }
  }
}

std::size_t TwistTable::bytes() const {
  std::size_t sum = 0;
  for (const Entry& entry : entries_) sum += sizeof(Entry) + sizeof(double) * entry.values.size();
  return sum;
}

void TwistMemory::prepare(Eigen::Index rows) { chunks_.resize(static_cast<std::size_t>(chunk_count(rows))); }

TwistMemory::Chunk& TwistMemory::chunk(Eigen::Index first_row) {
  return chunks_[static_cast<std::size_t>(first_row / kChunkRows)];
}

bool TwistMemory::has_room(std::size_t bytes, Eigen::Index rows) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 27;
  return bytes * static_cast<std::size_t>(chunk_count(rows)) <= kMostBytes;
}

}  // namespace fastcal
