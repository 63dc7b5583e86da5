// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Chunks of rows over threads. The chunks do not depend on the number of threads, so sums by chunk come out the same.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace fastcal {

constexpr Eigen::Index kChunkRows = 128;  // a chunk's Jacobian stays in the second-level cache

inline Eigen::Index chunk_count(Eigen::Index rows) { return (rows + kChunkRows - 1) / kChunkRows; }

/// Calls body(chunk, begin, end) for every chunk of [0, rows); rethrows the first exception.
template <typename Body>
void parallel_chunks(Eigen::Index rows, int threads, const Body& body) {
  const Eigen::Index chunks = chunk_count(rows);
  const auto one = [&](Eigen::Index chunk) {
    body(chunk, chunk * kChunkRows, std::min(rows, (chunk + 1) * kChunkRows));
  };
  const int workers = static_cast<int>(std::min<Eigen::Index>(std::max(threads, 1), chunks));
  if (workers <= 1) {
    for (Eigen::Index chunk = 0; chunk < chunks; ++chunk) one(chunk);
    return;
  }
  std::atomic<Eigen::Index> next{0};
  std::exception_ptr failure;
  std::mutex guard;
  const auto work = [&] {
    try {
      for (Eigen::Index chunk = next++; chunk < chunks; chunk = next++) one(chunk);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(guard);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> pool;
  for (int i = 1; i < workers; ++i) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace fastcal
