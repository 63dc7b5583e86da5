// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Four postures side by side: a Lane is one number of each. The arithmetic of a lane does not depend on its neighbours,
// so a posture gives the same bits wherever in a batch it is. Plain arrays only: these templates are compiled once
// for every instruction set, and nothing of another library may be (house rule for kernels).
#pragma once

#include <cmath>

#define FASTCAL_INLINE inline __attribute__((always_inline))

namespace fastcal::beam {

constexpr int kLanes = 4;

using Lane __attribute__((vector_size(kLanes * sizeof(double)), may_alias)) = double;
using LaneMask __attribute__((vector_size(kLanes * sizeof(long long)), may_alias)) = long long;

/// Storage of a Lane with its alignment, fit for std::vector.
struct alignas(kLanes * sizeof(double)) LaneStorage {
  double value[kLanes];
};

FASTCAL_INLINE void fill(Lane& lane, double value) { lane = Lane{value, value, value, value}; }

FASTCAL_INLINE void square_root(Lane& lane) {
  for (int i = 0; i < kLanes; ++i) lane[i] = std::sqrt(lane[i]);
}

}  // namespace fastcal::beam
