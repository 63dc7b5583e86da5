// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/streams.hpp"

#include <cstdint>
#include <cstring>

#include "fastcal/kernels/instruction_sets.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace fastcal::kernels {
namespace {

#if defined(__x86_64__)

/// Numbers before `to` is a multiple of so many bytes.
long before_multiple(const double* to, long count, unsigned bytes) {
  const auto over = reinterpret_cast<std::uintptr_t>(to) % bytes;
  const auto some = static_cast<long>(over == 0 ? 0 : (bytes - over) / sizeof(double));
  return some < count ? some : count;
}

void copy_baseline(const double* from, long count, double* to) {
  long k = before_multiple(to, count, sizeof(__m128d));
  std::memcpy(to, from, static_cast<std::size_t>(k) * sizeof(double));
  for (; k + 2 <= count; k += 2) _mm_stream_pd(to + k, _mm_loadu_pd(from + k));
  if (k < count) to[k] = from[k];
}

FASTCAL_AVX2 void copy_avx2(const double* from, long count, double* to) {
  long k = before_multiple(to, count, sizeof(__m256d));
  copy_baseline(from, k, to);
  for (; k + 4 <= count; k += 4) _mm256_stream_pd(to + k, _mm256_loadu_pd(from + k));
  copy_baseline(from + k, count - k, to + k);
}

#endif

}  // namespace

void copy_past_caches(const double* from, long count, double* to) {
#if defined(__x86_64__)
  static const auto run = instruction_set() == InstructionSet::kBaseline ? copy_baseline : copy_avx2;
  run(from, count, to);
#else
  std::memcpy(to, from, static_cast<std::size_t>(count) * sizeof(double));
#endif
}

LineStream::LineStream(double* buffer, double* to) : buffer_(buffer), to_(to) {
  if (buffer != nullptr)
    begin_ = end_ = static_cast<long>(reinterpret_cast<std::uintptr_t>(to) / sizeof(double) % kLine);
}

void LineStream::write(long count) {
  end_ += count;
  if (buffer_ == nullptr) return;
  const long whole = end_ / kLine * kLine;
  if (whole <= begin_) return;
  copy_past_caches(buffer_ + begin_, whole - begin_, to_);
  to_ += whole - begin_;
  begin_ = 0;
  end_ -= whole;
  std::memcpy(buffer_, buffer_ + whole, static_cast<std::size_t>(end_) * sizeof(double));
}

void LineStream::finish() {
  if (buffer_ != nullptr) copy_past_caches(buffer_ + begin_, end_ - begin_, to_);
}

void finish_copies() {
#if defined(__x86_64__)
  _mm_sfence();
#endif
}

}  // namespace fastcal::kernels
