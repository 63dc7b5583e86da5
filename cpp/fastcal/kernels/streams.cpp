// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/streams.hpp"

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace fastcal::kernels {

void copy_past_caches(const double* from, long count, double* to) {
#if defined(__SSE2__)
  long k = 0;
  if (count > 0 && reinterpret_cast<std::uintptr_t>(to) % sizeof(__m128d) != 0) to[k] = from[k], ++k;
  for (; k + 2 <= count; k += 2) _mm_stream_pd(to + k, _mm_loadu_pd(from + k));
  if (k < count) to[k] = from[k];
#else
  std::memcpy(to, from, static_cast<std::size_t>(count) * sizeof(double));
#endif
}

void finish_copies() {
#if defined(__SSE2__)
  _mm_sfence();
#endif
}

}  // namespace fastcal::kernels
