// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/twist_memory.hpp"

#include "fastcal/math/parallel.hpp"

namespace fastcal {

void TwistMemory::prepare(Eigen::Index rows) { chunks_.resize(static_cast<std::size_t>(chunk_count(rows))); }

TwistMemory::Chunk& TwistMemory::chunk(Eigen::Index first_row) {
  return chunks_[static_cast<std::size_t>(first_row / kChunkRows)];
}

bool TwistMemory::has_room(std::size_t bytes, Eigen::Index rows) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 27;
  return bytes * static_cast<std::size_t>(chunk_count(rows)) <= kMostBytes;
}

}  // namespace fastcal
