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

#include "fastcal/math/thread_pool.hpp"

namespace fastcal {

constexpr Eigen::Index kChunkRows = 120;  // their Jacobian stays in the second-level cache, in all of its sets

inline Eigen::Index chunk_count(Eigen::Index rows) { return (rows + kChunkRows - 1) / kChunkRows; }

/// Calls body(worker, unit) for every unit of [0, units), worker = make() one a thread; rethrows the first exception.
template <typename Make, typename Body>
void parallel_units(Eigen::Index units, int threads, const Make& make, const Body& body) {
  const int workers = static_cast<int>(std::min<Eigen::Index>(std::max(threads, 1), units));
  if (workers <= 1) {  // without what threads share: each look at a shared counter waits for all writes before it
    if (units == 0) return;
    auto worker = make();
    for (Eigen::Index unit = 0; unit < units; ++unit) body(worker, unit);
    return;
  }
  std::atomic<Eigen::Index> next{0};
  std::exception_ptr failure;
  std::mutex guard;
  const auto work = [&] {
    try {
      auto worker = make();
      for (Eigen::Index unit = next++; unit < units; unit = next++) body(worker, unit);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(guard);
      if (!failure) failure = std::current_exception();
    }
  };
  run_together(workers - 1, work);
  if (failure) std::rethrow_exception(failure);
}

/// The same for chunks of [0, rows): body(worker, chunk, begin, end).
template <typename Make, typename Body>
void parallel_chunks(Eigen::Index rows, int threads, const Make& make, const Body& body) {
  parallel_units(chunk_count(rows), threads, make, [&body, rows](auto& worker, Eigen::Index chunk) {
    body(worker, chunk, chunk * kChunkRows, std::min(rows, (chunk + 1) * kChunkRows));
  });
}

/// The same for bodies that need nothing of their own: body(chunk, begin, end).
template <typename Body>
void parallel_chunks(Eigen::Index rows, int threads, const Body& body) {
  parallel_chunks(
      rows, threads, [] { return 0; },
      [&body](int, Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) { body(chunk, begin, end); });
}

}  // namespace fastcal
