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

/// What this thread copied past the caches is in memory.
void finish_copies();

}  // namespace fastcal::kernels
