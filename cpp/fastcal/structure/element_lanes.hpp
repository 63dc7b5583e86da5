// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One beam element in four postures. All of its stiffness is that of its end with the start clamped, S (B x B): with
// v = u_end - H^T u_start, the end's displacement beyond the start's rigid motion, the end feels S v and the start
// -H S v, H carrying a wrench over the lever r from start to end. So every element is in equilibrium exactly, whatever
// S.
//   S, bending in x-y with k = E I_z / (L^3 (1 + phi)), phi = 12 E I_z / (G A_y L^2):
//     [12 k, -6 L k; -6 L k, (4 + phi) L^2 k]; the other plane alike with +6; axial E A / L; torsion G J / L
//   (J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968, eq. 5.116).
//   A hinge gives the end a rotation of its own along h; minimising over it, S <- S - S h h^T S / (h^T S h).
//   Own weight m g, spread evenly: m g / 2 at each end, the moment m/12 r x g at the start and its opposite at the end.
#pragma once

#include "fastcal/structure/beam_kernel.hpp"

namespace fastcal::beam {

template <int D>
struct ElementLanes {
  static constexpr int B = D == 2 ? 3 : 6;
  static constexpr int R = B - D;  // rotations
  Lane r[D];                       // lever from start to end
  Lane length;
  Lane axes[D][D];     // local x, y (, z), each a row
  Lane S[B][B];        // local, then global
  Lane correction[B];  // what hinges change in the weight's forces at the end; the start gets -H of it
};

/// w <- H w: the same wrench, its moment taken about the start of r instead of its end.
template <int D>
FASTCAL_INLINE void carry(const Lane (&r)[D], Lane* w, int step) {
  if constexpr (D == 2) {
    w[2 * step] += r[0] * w[step] - r[1] * w[0];
  } else {
    w[3 * step] += r[1] * w[2 * step] - r[2] * w[step];
    w[4 * step] += r[2] * w[0] - r[0] * w[2 * step];
    w[5 * step] += r[0] * w[step] - r[1] * w[0];
  }
}

/// Local axes from the lever and, in space, from `up`. An undefined direction leaves NaN, caught by the solution.
template <int D>
FASTCAL_INLINE void find_axes(ElementLanes<D>& e, const Lane* up, bool round) {
  Lane square = e.r[0] * e.r[0];
  for (int i = 1; i < D; ++i) square += e.r[i] * e.r[i];
  e.length = square;
  square_root(e.length);
  for (int i = 0; i < D; ++i) e.axes[0][i] = e.r[i] / e.length;
  if constexpr (D == 2) {
    e.axes[1][0] = -e.axes[0][1];
    e.axes[1][1] = e.axes[0][0];
  } else {
    const Lane* x = e.axes[0];
    Lane* y = e.axes[1];
    Lane* z = e.axes[2];
    Lane side[3] = {up[0], up[1], up[2]};
    if (round) {  // the coordinate axis furthest from x, in every lane for itself
      const Lane sx = x[0] * x[0], sy = x[1] * x[1], sz = x[2] * x[2];
      const Lane zero = {}, one = zero + 1.0;
      const LaneMask take_x = (sx <= sy) & (sx <= sz), take_y = ~take_x & (sy <= sz);
      side[0] = take_x ? one : zero;
      side[1] = take_y ? one : zero;
      side[2] = one - side[0] - side[1];
    }
    const Lane along = side[0] * x[0] + side[1] * x[1] + side[2] * x[2];
    const Lane size = side[0] * side[0] + side[1] * side[1] + side[2] * side[2];
    for (int i = 0; i < 3; ++i) z[i] = side[i] - along * x[i];
    Lane across = z[0] * z[0] + z[1] * z[1] + z[2] * z[2];
    Lane missing;
    fill(missing, __builtin_nan(""));
    across = across > 1e-12 * size ? across : missing;
    square_root(across);
    for (int i = 0; i < 3; ++i) z[i] /= across;
    y[0] = z[1] * x[2] - z[2] * x[1];
    y[1] = z[2] * x[0] - z[0] * x[2];
    y[2] = z[0] * x[1] - z[1] * x[0];
  }
}

/// Bending in one plane: translation t, rotation c; sign is that of the rotation's lever (+1: turning moves +t).
template <int D>
FASTCAL_INLINE void set_bending(ElementLanes<D>& e, int t, int c, double sign, double EI, double GA) {
  const Lane L2 = e.length * e.length;
  Lane phi = {};
  if (GA > 0) phi = 12 * EI / (GA * L2);
  const Lane k = EI / (L2 * e.length * (1.0 + phi));
  e.S[t][t] = 12.0 * k;
  e.S[c][c] = (4.0 + phi) * L2 * k;
  e.S[t][c] = e.S[c][t] = -6.0 * sign * e.length * k;
}

template <int D>
FASTCAL_INLINE void set_section(ElementLanes<D>& e, const double* section) {
  for (auto& row : e.S) {
    for (Lane& entry : row) entry = Lane{};
  }
  e.S[0][0] = section[0] / e.length;
  if constexpr (D == 2) {
    set_bending(e, 1, 2, 1.0, section[2], section[4]);
  } else {
    set_bending(e, 1, 5, 1.0, section[2], section[4]);
    set_bending(e, 2, 4, -1.0, section[1], section[5]);
    e.S[3][3] = section[3] / e.length;
  }
}

/// Lets the end (1) or the start (0) turn about local axis `a` (0 x, 1 y, 2 z) apart from its node.
template <int D>
FASTCAL_INLINE void release(ElementLanes<D>& e, int end, int a, const Lane& moment) {
  constexpr int B = ElementLanes<D>::B;
  const int c = D == 2 ? 2 : 3 + a;
  const int t = a == 2 ? 1 : 2;  // what turning the start moves at the end: +y about z, -z about y, nothing about x
  Lane lever = {};
  if (end == 0 && a != 0) lever = a == 2 ? e.length : -e.length;
  Lane Sh[B];
  for (int i = 0; i < B; ++i) Sh[i] = e.S[i][c] + e.S[i][t] * lever;
  const Lane s = Sh[c] + Sh[t] * lever;
  const Lane own = e.correction[c] + e.correction[t] * lever;
  const Lane turn = (end == 1 ? -(own + moment) : moment - own) / s;
  const Lane inverse = 1.0 / s;
  for (int i = 0; i < B; ++i) {
    e.correction[i] += Sh[i] * turn;
    const Lane scaled = Sh[i] * inverse;
    for (int j = 0; j < B; ++j) e.S[i][j] -= scaled * Sh[j];
  }
}

/// M <- A^T M A for a D x D block, A the local axes as rows.
FASTCAL_INLINE void turn_block(const Lane (&A)[3][3], Lane (*S)[6], int row, int column) {
  Lane half[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      half[i][j] = S[row + i][column] * A[0][j] + S[row + i][column + 1] * A[1][j] + S[row + i][column + 2] * A[2][j];
    }
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      S[row + i][column + j] = A[0][i] * half[0][j] + A[1][i] * half[1][j] + A[2][i] * half[2][j];
    }
  }
}

FASTCAL_INLINE void turn_vector(const Lane (&A)[3][3], Lane* v) {
  const Lane x = v[0], y = v[1], z = v[2];
  for (int i = 0; i < 3; ++i) v[i] = A[0][i] * x + A[1][i] * y + A[2][i] * z;
}

/// From local to global axes.
FASTCAL_INLINE void turn_to_global(ElementLanes<2>& e, bool corrected) {
  const Lane c = e.axes[0][0], s = e.axes[0][1];
  const Lane a = e.S[0][0], b = e.S[0][1], d = e.S[1][1], p = e.S[0][2], q = e.S[1][2];
  e.S[0][0] = c * c * a - 2.0 * c * s * b + s * s * d;
  e.S[1][1] = s * s * a + 2.0 * c * s * b + c * c * d;
  e.S[0][1] = e.S[1][0] = c * s * (a - d) + (c * c - s * s) * b;
  e.S[0][2] = e.S[2][0] = c * p - s * q;
  e.S[1][2] = e.S[2][1] = s * p + c * q;
  if (corrected) {
    const Lane x = e.correction[0], y = e.correction[1];
    e.correction[0] = c * x - s * y;
    e.correction[1] = s * x + c * y;
  }
}

FASTCAL_INLINE void turn_to_global(ElementLanes<3>& e, bool corrected) {
  turn_block(e.axes, e.S, 0, 0);
  turn_block(e.axes, e.S, 0, 3);
  turn_block(e.axes, e.S, 3, 3);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) e.S[3 + j][i] = e.S[i][3 + j];
  }
  if (corrected) {
    turn_vector(e.axes, e.correction);
    turn_vector(e.axes, e.correction + 3);
  }
}

}  // namespace fastcal::beam
