// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows side by side: a Lane is one number of each of W rows. The arithmetic of a lane does not depend on its
// neighbours, so a row gives the same bits wherever in a batch it is. Plain arrays only: these templates are
// compiled once for every instruction set, and nothing of another library may be.
#pragma once

#define FASTCAL_INLINE inline __attribute__((always_inline))

namespace fastcal::kernels {

template <int W>
struct Vectors {
  using Lane __attribute__((vector_size(W * sizeof(double)), may_alias)) = double;
  using Mask __attribute__((vector_size(W * sizeof(long long)), may_alias)) = long long;
  using Memory __attribute__((vector_size(W * sizeof(double)), may_alias, aligned(sizeof(double)))) = double;
};

template <typename Lane>
FASTCAL_INLINE void load(Lane& to, const double* from) {
  to = *reinterpret_cast<const typename Vectors<sizeof(Lane) / sizeof(double)>::Memory*>(from);
}

template <typename Lane>
FASTCAL_INLINE void store(double* to, const Lane& from) {
  *reinterpret_cast<typename Vectors<sizeof(Lane) / sizeof(double)>::Memory*>(to) = from;
}

/// The lanes of a and b, as if in one row, that the numbers name.
template <int... From, typename Lane>
FASTCAL_INLINE void shuffle(Lane& to, const Lane& a, const Lane& b) {
#if defined(__clang__)
  to = __builtin_shufflevector(a, b, From...);
#else
  to = __builtin_shuffle(a, b, typename Vectors<sizeof...(From)>::Mask{From...});
#endif
}

/// Four lanes of four numbers as a matrix, transposed.
FASTCAL_INLINE void transpose(Vectors<4>::Lane (&rows)[4]) {
  Vectors<4>::Lane even[2], odd[2];
  for (int k = 0; k < 2; ++k) {
    shuffle<0, 4, 2, 6>(even[k], rows[2 * k], rows[2 * k + 1]);
    shuffle<1, 5, 3, 7>(odd[k], rows[2 * k], rows[2 * k + 1]);
  }
  shuffle<0, 1, 4, 5>(rows[0], even[0], even[1]);
  shuffle<0, 1, 4, 5>(rows[1], odd[0], odd[1]);
  shuffle<2, 3, 6, 7>(rows[2], even[0], even[1]);
  shuffle<2, 3, 6, 7>(rows[3], odd[0], odd[1]);
}

/// Four numbers of each of four columns, as four rows. Halves are joined as they are loaded, which takes half as many
/// shuffles as a transposition of whole lanes.
FASTCAL_INLINE void load_rows(Vectors<4>::Lane (&rows)[4], const double* const (&columns)[4]) {
  for (int half = 0; half < 4; half += 2) {
    Vectors<2>::Lane column[4];
    for (int c = 0; c < 4; ++c) load(column[c], columns[c] + half);
    const Vectors<4>::Lane even = __builtin_shufflevector(column[0], column[2], 0, 1, 2, 3);
    const Vectors<4>::Lane odd = __builtin_shufflevector(column[1], column[3], 0, 1, 2, 3);
    shuffle<0, 4, 2, 6>(rows[half], even, odd);
    shuffle<1, 5, 3, 7>(rows[half + 1], even, odd);
  }
}

/// Sine and cosine: x less a multiple of pi / 2 in three parts, then polynomials that interpolate
/// (sin r - r) / r^3 and (cos r - 1 + r^2 / 2) / r^4 in Chebyshev points of [0, pi / 4]; |x| < 1e6, error 2 ulp.
template <int W>
FASTCAL_INLINE void sine_cosine(const typename Vectors<W>::Lane& x, typename Vectors<W>::Lane& s,
                                typename Vectors<W>::Lane& c) {
  using Lane = typename Vectors<W>::Lane;
  using Mask = typename Vectors<W>::Mask;
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: added, it leaves the integer in the low bits
  const Lane shifted = x * 0.63661977236758134 + kRound;
  const Lane quarters = shifted - kRound;
  const Mask quadrant = (Mask)shifted;
  Lane r = x - quarters * 0x1.921fb544p+0;
  r = r - quarters * 0x1.0b46118p-34;
  r = r - quarters * 0x1.313198a2e0370p-61;
  const Lane z = r * r;
  const Lane sine =
      r + r * z *
              (-0.16666666666666664 +
               z * (0.0083333333333307006 +
                    z * (-0.00019841269836387346 +
                         z * (2.7557315911911159e-6 + z * (-2.5051092507061386e-8 + z * 1.59153232122714e-10)))));
  const Lane cosine =
      1.0 - 0.5 * z +
      z * z *
          (0.041666666666666665 +
           z * (-0.0013888888888887242 +
                z * (2.4801587298533455e-5 +
                     z * (-2.755731715246704e-7 + z * (2.0876121658871159e-9 + z * -1.1380876948169716e-11)))));
  const Mask swap = (quadrant & 1) == 1;
  const Lane a = swap ? cosine : sine;
  const Lane b = swap ? sine : cosine;
  // Two quadrants of the four have the other sign, which is the top bit.
  s = (Lane)((Mask)a ^ ((quadrant & 2) << 62));
  c = (Lane)((Mask)b ^ (((quadrant + 1) & 2) << 62));
}

}  // namespace fastcal::kernels
