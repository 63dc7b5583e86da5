// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One iteration of damped least squares for W targets side by side. The arithmetic of a lane does not depend on its
// neighbours, so a target gives the same bits wherever in a batch it is.
//   error e = [p* - p; sum_k r_k x r*_k / (2 cos(angle / 2))], the second 2 sin(angle / 2) about the axis between R and
//   R* dq = J^T (J J^T + damping |e|^2 1)^-1 e,  columns of joints that a limit stops are 0
// (S. Chan, P. Lawrence, "General inverse kinematics with the error damped pseudoinverse", 1988).
#pragma once

#include "fastcal/ik/chain_kernel.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::ik {

using kernels::sine_cosine;
using kernels::Vectors;

template <int W, int N>
struct ChainLanes {
  using Lane = typename Vectors<W>::Lane;
  using Mask = typename Vectors<W>::Mask;
  static constexpr int kJoints = N > 0 ? N : kMaxJoints;
  static constexpr double kDamping = 0.03;
  static constexpr double kLeastDamping = 1e-20;  // keeps the factor finite in singular postures
  static constexpr double kOpposite = 1e-6;       // (1 + cos angle) / 2 of rotations that have no axis between them

  int n;
  Lane q[kJoints], target[kPoseNumbers];
  Lane axis[kJoints][3], origin[kJoints][3];
  Lane R[3][3], p[3];  // columns of the rotation, position
  Lane J[kJoints][6], e[6];
  Lane A[6][6];  // J J^T + damping; after step(): L D below and D in the diagonal of L D L^T
  Lane position_square, rotation_square;

  FASTCAL_INLINE explicit ChainLanes(int joint_count) : n(N > 0 ? N : joint_count) {}

  /// Axes, origins and the tool at q.
  FASTCAL_INLINE void forward(const ChainPlan& plan) {
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) R[c][r] = Lane{} + (r == c ? 1.0 : 0.0);
      p[c] = Lane{};
    }
#pragma GCC unroll 8
    for (int i = 0; i < n; ++i) {
      for (int r = 0; r < 3; ++r) {
        axis[i][r] = R[2][r];
        origin[i][r] = p[r];
      }
      if (plan.revolute[i]) {
        Lane s, c;
        sine_cosine<W>(q[i], s, c);
        for (int r = 0; r < 3; ++r) {
          const Lane x = R[0][r];
          R[0][r] = c * x + s * R[1][r];
          R[1][r] = c * R[1][r] - s * x;
        }
      } else {
        for (int r = 0; r < 3; ++r) p[r] += q[i] * R[2][r];
      }
      const double* A = plan.after[i];
      for (int r = 0; r < 3; ++r) {
        const Lane x = R[0][r], y = R[1][r], z = R[2][r];
        p[r] += A[9] * x + A[10] * y + A[11] * z;
        for (int c = 0; c < 3; ++c) R[c][r] = A[c] * x + A[3 + c] * y + A[6 + c] * z;
      }
    }
  }

  FASTCAL_INLINE void compare() {
    Lane twice[3] = {}, cosines = {};
    for (int c = 0; c < 3; ++c) {
      const Lane x = target[c], y = target[3 + c], z = target[6 + c];
      twice[0] += R[c][1] * z - R[c][2] * y;
      twice[1] += R[c][2] * x - R[c][0] * z;
      twice[2] += R[c][0] * y - R[c][1] * x;
      cosines += R[c][0] * x + R[c][1] * y + R[c][2] * z;
    }
    Lane half = 0.25 * (1.0 + cosines);  // cos^2(angle / 2)
    half = half > kOpposite ? half : Lane{} + kOpposite;
    for (int lane = 0; lane < W; ++lane) half[lane] = std::sqrt(half[lane]);
    const Lane factor = 0.5 / half;
    for (int r = 0; r < 3; ++r) {
      e[r] = target[9 + r] - p[r];
      e[3 + r] = factor * twice[r];
    }
    position_square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    rotation_square = e[3] * e[3] + e[4] * e[4] + e[5] * e[5];
  }

  /// Moves q by one step. Needs forward() and compare().
  FASTCAL_INLINE void step(const ChainPlan& plan) {
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c <= r; ++c) A[r][c] = Lane{};
    }
#pragma GCC unroll 8
    for (int i = 0; i < n; ++i) {
      if (plan.held[i]) continue;
      const Lane *z = axis[i], lever[3] = {p[0] - origin[i][0], p[1] - origin[i][1], p[2] - origin[i][2]};
      Lane column[6] = {z[0], z[1], z[2], Lane{}, Lane{}, Lane{}};
      if (plan.revolute[i]) {
        for (int r = 0; r < 3; ++r) column[3 + r] = z[r];
        column[0] = z[1] * lever[2] - z[2] * lever[1];
        column[1] = z[2] * lever[0] - z[0] * lever[2];
        column[2] = z[0] * lever[1] - z[1] * lever[0];
      }
      Lane pull = {};
      for (int r = 0; r < 6; ++r) pull += column[r] * e[r];
      const Mask stopped = ((q[i] <= plan.low[i]) & (pull < 0.0)) | ((q[i] >= plan.high[i]) & (pull > 0.0));
      for (int r = 0; r < 6; ++r) J[i][r] = stopped ? Lane{} : column[r];
      for (int r = 0; r < 6; ++r) {
        for (int c = 0; c <= r; ++c) A[r][c] += J[i][r] * J[i][c];
      }
    }
    const Lane damping = kDamping * (position_square + rotation_square) + kLeastDamping;
    for (int r = 0; r < 6; ++r) A[r][r] += damping;
    Lane y[6], inverse[6];
    for (int c = 0; c < 6; ++c) {
      inverse[c] = 1.0 / A[c][c];
      for (int r = c + 1; r < 6; ++r) {
        const Lane l = A[r][c] * inverse[c];
        for (int k = c + 1; k <= r; ++k) A[r][k] -= l * A[k][c];
      }
    }
    for (int r = 0; r < 6; ++r) {
      y[r] = e[r];
      for (int c = 0; c < r; ++c) y[r] -= A[r][c] * inverse[c] * y[c];
    }
    for (int r = 5; r >= 0; --r) {
      Lane sum = y[r];
      for (int c = r + 1; c < 6; ++c) sum -= A[c][r] * y[c];
      y[r] = sum * inverse[r];
    }
#pragma GCC unroll 8
    for (int i = 0; i < n; ++i) {
      if (plan.held[i]) continue;
      Lane to = q[i];
      for (int r = 0; r < 6; ++r) to += J[i][r] * y[r];
      to = to < plan.low[i] ? Lane{} + plan.low[i] : to;
      q[i] = to > plan.high[i] ? Lane{} + plan.high[i] : to;
    }
  }

  /// 1 / sqrt(trace((J J^T)^-1)) of one lane after step(): between the least singular value and that over sqrt(6).
  double least_singular_value(int lane) const {
    double L[6][6], sum = 0;  // L, then its inverse
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < r; ++c) {
        double l = -A[r][c][lane] / A[c][c][lane];
        for (int k = c + 1; k < r; ++k) l -= A[r][k][lane] / A[k][k][lane] * L[k][c];
        L[r][c] = l;
        sum += l * l / A[r][r][lane];
      }
      sum += 1 / A[r][r][lane];
    }
    return 1 / std::sqrt(sum);
  }
};

}  // namespace fastcal::ik
