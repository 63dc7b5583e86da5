// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Results that no cache holds.
#pragma once

namespace fastcal::kernels {

/// Is an array of so many numbers better written past the caches?
constexpr bool is_beyond_caches(long count) { return count > (1L << 19); }  // 4 MiB, about a core's own caches

/// Copies `count` numbers past the caches where the processor can: a line that is written as a whole need not be read
/// before, and what the caches hold stays. Another thread may read them after finish_copies().
void copy_past_caches(const double* from, long count, double* to);

constexpr int kLine = 8;  // numbers of a cache's line

/// An array written part after part; past the caches in whole lines: one that is written in two goes is slow.
class LineStream {
 public:
  /// `buffer`: where a line begins, room for a part and a line more; null: not past the caches.
  LineStream(double* buffer, double* to);
  /// Where the next part is to lie before it is written.
  double* room() { return (buffer_ == nullptr ? to_ : buffer_) + end_; }
  void write(long count);
  /// The part of a line that is left.
  void finish();

 private:
  double* buffer_;
  double* to_;
  long begin_ = 0, end_ = 0;  // what is not written yet
};

/// What this thread copied past the caches is in memory.
void finish_copies();

}  // namespace fastcal::kernels
