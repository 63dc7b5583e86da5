// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Damped least squares on a chain without effects, many targets side by side; plain arrays only, compiled for the
// instruction sets chosen from at run time. All lengths are over the reach, so that they may be compared with angles.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace fastcal::ik {

constexpr int kMaxJoints = 24;

/// A rotation, row by row, and a position.
constexpr int kPoseNumbers = 12;

/// What all targets share: T = Z_1 A_1 Z_2 ... Z_n A_n, Z_i the joint's motion about or along z.
struct ChainPlan {
  int joint_count;
  bool revolute[kMaxJoints];
  bool held[kMaxJoints];                      ///< stays at the seed
  double after[kMaxJoints][kPoseNumbers];     ///< A_i
  double low[kMaxJoints], high[kMaxJoints];   ///< limits
  double from[kMaxJoints], span[kMaxJoints];  ///< where restarts are drawn from
  double ratio[kMaxJoints];                   ///< of the Kronecker sequence of restarts
  double tolerance_position, tolerance_rotation;
  double close;  ///< squared error at which an attempt that is stuck ends the search, a solution being next to it; or 0
  int restarts;
  int iterations;  ///< of one attempt at most
  std::uint64_t random_seed;
};

/// Targets and what was found, C order.
struct ChainBatch {
  int count;
  const std::ptrdiff_t* row;     ///< by which the restarts are drawn
  const double* target;          ///< (count, kPoseNumbers), before joint 1
  const double* seed;            ///< (count, n)
  double* q;                     ///< (count, n) the solution, or the best that was met
  double* position_error;        ///< (count)
  double* rotation_error;        ///< (count)
  double* least_singular_value;  ///< (count) of J, no less than this; joints at a limit perhaps left out
  bool* reached;                 ///< (count)
  int* evaluations;              ///< (count)
};

/// A number even in [0, 1) that depends on what it is counted by and on nothing else (G. Steele, D. Lea, C. Flood,
/// "Fast splittable pseudorandom number generators", 2014).
inline double hashed(std::uint64_t seed, std::ptrdiff_t row, int joint) {
  std::uint64_t z = seed * 0xD1342543DE82EF95u + static_cast<std::uint64_t>(row) * 0x9E3779B97F4A7C15u +
                    static_cast<std::uint64_t>(joint + 1) * 0xDA942042E4DD58B5u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/// Joint i of restart k of a row: a Kronecker sequence with a shift of the row's own.
inline double restart(const ChainPlan& plan, std::ptrdiff_t row, int k, int i) {
  const double u = hashed(plan.random_seed, row, i) + k * plan.ratio[i];
  return plan.from[i] + (u - std::floor(u)) * plan.span[i];
}

/// Solves all targets of the batch.
void solve_chain(const ChainPlan& plan, const ChainBatch& batch);

}  // namespace fastcal::ik
