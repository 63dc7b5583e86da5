// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// K = L D L^T by blocks of B x B, four postures at once, on the pattern of elimination.hpp.
// A direction that is held has the reciprocal pivot 0: that alone takes its row and column out of the solution.
#pragma once

#include "fastcal/structure/beam_kernel.hpp"

namespace fastcal::beam {

/// Below this share of its diagonal entry a pivot is rounding error: the frame can move without being strained.
constexpr double kSmallestPivot = 1e-12;

/// Factorizes `blocks` in place: unit L in the lower triangles and the sub-diagonal blocks, 1/D in `inverse`. `failed`
/// collects the lanes in which a pivot is not above kSmallestPivot times its diagonal entry, NaN included.
template <int B>
FASTCAL_INLINE void factorize(const BeamPlan& plan, Lane* blocks, Lane* inverse, LaneMask& failed) {
  Lane threshold[B];
  const auto block = [blocks](int index) __attribute__((always_inline)) { return blocks + index * B * B; };
  // The pivots are compared with the diagonal before elimination, which this borrows `inverse` to remember.
  for (int k = 0; k < plan.free_count; ++k) {
    for (int c = 0; c < B; ++c) inverse[k * B + c] = kSmallestPivot * block(k)[c * B + c];
  }
  const int* update = plan.update;
  for (int k = 0; k < plan.free_count; ++k) {
    Lane* A = block(k);
    Lane* inv = inverse + k * B;
    Lane pivot[B];
    for (int c = 0; c < B; ++c) threshold[c] = inv[c];
    for (int c = 0; c < B; ++c) {
      pivot[c] = A[c * B + c];
      if (plan.held[k] >> c & 1u) {
        inv[c] = Lane{};
      } else {
        failed |= ~(pivot[c] > threshold[c]);
        inv[c] = 1.0 / pivot[c];
      }
      for (int r = c + 1; r < B; ++r) {
        const Lane l = A[r * B + c] * inv[c];
        for (int m = c + 1; m <= r; ++m) A[r * B + m] -= l * A[m * B + c];
      }
      for (int r = c + 1; r < B; ++r) A[r * B + c] *= inv[c];
    }
    const int begin = plan.slot_begin[k], end = plan.slot_begin[k + 1];
    for (int i = begin; i < end; ++i) {
      Lane* X = block(plan.free_count + i);
      Lane W[B][B];  // L_ik D, while X becomes L_ik
      for (int r = 0; r < B; ++r) {
        for (int c = 0; c < B; ++c) {
          Lane w = X[r * B + c];
          for (int m = 0; m < c; ++m) w -= W[r][m] * A[c * B + m];
          W[r][c] = w;
        }
        for (int c = 0; c < B; ++c) X[r * B + c] = W[r][c] * inv[c];
      }
      for (int j = begin; j <= i; ++j) {
        const Lane* Y = block(plan.free_count + j);
        Lane* target = block(*update++);
        for (int r = 0; r < B; ++r) {
          for (int c = 0; c < B; ++c) {
            Lane sum = target[r * B + c];
            for (int m = 0; m < B; ++m) sum -= W[r][m] * Y[c * B + m];
            target[r * B + c] = sum;
          }
        }
      }
    }
  }
}

/// x <- K^-1 x for one right-hand side (free_count, B).
template <int B>
FASTCAL_INLINE void substitute(const BeamPlan& plan, const Lane* blocks, const Lane* inverse, Lane* x) {
  for (int k = 0; k < plan.free_count; ++k) {
    const Lane* A = blocks + k * B * B;
    Lane* b = x + k * B;
    for (int r = 1; r < B; ++r) {
      for (int c = 0; c < r; ++c) b[r] -= A[r * B + c] * b[c];
    }
    for (int s = plan.slot_begin[k]; s < plan.slot_begin[k + 1]; ++s) {
      const Lane* Y = blocks + (plan.free_count + s) * B * B;
      Lane* target = x + plan.slot_row[s] * B;
      for (int r = 0; r < B; ++r) {
        for (int c = 0; c < B; ++c) target[r] -= Y[r * B + c] * b[c];
      }
    }
  }
  for (int k = plan.free_count - 1; k >= 0; --k) {
    const Lane* A = blocks + k * B * B;
    Lane* b = x + k * B;
    for (int c = 0; c < B; ++c) b[c] *= inverse[k * B + c];
    for (int s = plan.slot_begin[k]; s < plan.slot_begin[k + 1]; ++s) {
      const Lane* Y = blocks + (plan.free_count + s) * B * B;
      const Lane* source = x + plan.slot_row[s] * B;
      for (int r = 0; r < B; ++r) {
        for (int c = 0; c < B; ++c) b[c] -= Y[r * B + c] * source[r];
      }
    }
    for (int r = B - 1; r > 0; --r) {
      for (int c = 0; c < r; ++c) b[c] -= A[r * B + c] * b[r];
    }
  }
}

}  // namespace fastcal::beam
