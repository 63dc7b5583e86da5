// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The numbers of a group of kGroup rows as one: in narrow sets several lanes side by side, so that where each step
// waits for the one before, the steps of one lane fill the pauses of the other.
#pragma once

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {

template <int W>
struct Group {
  using Lane = typename Vectors<W>::Lane;
  static constexpr int kParts = kGroup / W;
  Lane part[kParts];

  FASTCAL_INLINE Group() {
    for (int p = 0; p < kParts; ++p) part[p] = Lane{};
  }
  FASTCAL_INLINE Group(double number) {  // NOLINT(google-explicit-constructor): as for lanes
    for (int p = 0; p < kParts; ++p)
      part[p] = number - Lane{};  // a sum with 0 is not folded: it may change the sign of 0
  }
  FASTCAL_INLINE void load(const double* from) {
    for (int p = 0; p < kParts; ++p) kernels::load(part[p], from + p * W);
  }
  FASTCAL_INLINE void store(double* to) const {
    for (int p = 0; p < kParts; ++p) kernels::store(to + p * W, part[p]);
  }

  friend FASTCAL_INLINE Group operator+(const Group& a, const Group& b) {
    Group out;
    for (int p = 0; p < kParts; ++p) out.part[p] = a.part[p] + b.part[p];
    return out;
  }
  friend FASTCAL_INLINE Group operator-(const Group& a, const Group& b) {
    Group out;
    for (int p = 0; p < kParts; ++p) out.part[p] = a.part[p] - b.part[p];
    return out;
  }
  friend FASTCAL_INLINE Group operator*(const Group& a, const Group& b) {
    Group out;
    for (int p = 0; p < kParts; ++p) out.part[p] = a.part[p] * b.part[p];
    return out;
  }
  friend FASTCAL_INLINE Group operator/(const Group& a, const Group& b) {
    Group out;
    for (int p = 0; p < kParts; ++p) out.part[p] = a.part[p] / b.part[p];
    return out;
  }
  FASTCAL_INLINE Group& operator+=(const Group& b) {
    for (int p = 0; p < kParts; ++p) part[p] += b.part[p];
    return *this;
  }

  /// Where a is above the bound, x; else y.
  static FASTCAL_INLINE Group choose(const Group& a, const Group& bound, const Group& x, const Group& y) {
    Group out;
    for (int p = 0; p < kParts; ++p) out.part[p] = a.part[p] > bound.part[p] ? x.part[p] : y.part[p];
    return out;
  }
  static FASTCAL_INLINE Group larger(const Group& a, const Group& b) { return choose(a, b, a, b); }
  FASTCAL_INLINE bool any() const {
    Lane sum = part[0] * part[0];
    for (int p = 1; p < kParts; ++p) sum += part[p] * part[p];
    double total = 0;
    for (int l = 0; l < W; ++l) total += sum[l];
    return total != 0;
  }
};

}  // namespace fastcal::kernels
