// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/normal_sums.hpp"

#include <cmath>

#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {
namespace {

constexpr int kTile = 4;
constexpr int kReflected = 8;        // columns side by side, so that their sums need not wait for each other
constexpr double kNothing = 1e-290;  // squared length: below, its inverse overflows

/// By halves: a chain of additions would wait for each of them.
template <typename Lane>
FASTCAL_INLINE double sum_of(const Lane& lane) {
  const double half = (lane[0] + lane[2]) + (lane[1] + lane[3]);
  if constexpr (sizeof(Lane) == 4 * sizeof(double)) {
    return half;
  } else {
    return half + ((lane[4] + lane[6]) + (lane[5] + lane[7]));
  }
}

template <int W>
FASTCAL_INLINE void gram_lanes(const double* block, int ld, int rows, int columns, double* A) {
  using Lane = typename Vectors<W>::Lane;
  for (int j = 0; j < columns; j += kTile) {
    for (int i = 0; i <= j; i += kTile) {
      // At the edge the last column is taken again, unheard.
      const double *left[kTile], *right[kTile];
      for (int k = 0; k < kTile; ++k) {
        left[k] = block + static_cast<long>(i + k < columns ? i + k : columns - 1) * ld;
        right[k] = block + static_cast<long>(j + k < columns ? j + k : columns - 1) * ld;
      }
      Lane sums[kTile][kTile] = {};
      for (int row = 0; row < rows; row += W) {
        Lane a[kTile], b;
        for (int k = 0; k < kTile; ++k) load(a[k], left[k] + row);
        for (int c = 0; c < kTile; ++c) {
          load(b, right[c] + row);
          for (int k = 0; k < kTile; ++k) sums[k][c] += a[k] * b;
        }
      }
      for (int c = 0; c < kTile && j + c < columns; ++c) {
        for (int k = 0; k < kTile && i + k <= j + c; ++k) A[(j + c) * columns + i + k] = sum_of(sums[k][c]);
      }
    }
  }
}

/// N lanes of rows: their sums need not wait for each other.
template <int W, int N, typename Lane>
FASTCAL_INLINE void add_along(const double* block, int ld, int columns, const double* x, const double* y,
                              Lane& square_x, Lane& square_y) {
  Lane along_x[N] = {}, along_y[N] = {}, b;
  for (int k = 0; k < columns; ++k, block += ld) {
    for (int n = 0; n < N; ++n) {
      load(b, block + n * W);
      along_x[n] += x[k] * b;
      along_y[n] += y[k] * b;
    }
  }
  for (int n = 0; n < N; ++n) {
    square_x += along_x[n] * along_x[n];
    square_y += along_y[n] * along_y[n];
  }
}

template <int W>
FASTCAL_INLINE void along_lanes(const double* block, int ld, int rows, int columns, const double* x, const double* y,
                                double* out) {
  typename Vectors<W>::Lane square_x = {}, square_y = {};
  int row = 0;
  for (; row + kTile * W <= rows; row += kTile * W)
    add_along<W, kTile>(block + row, ld, columns, x, y, square_x, square_y);
  for (; row < rows; row += W) add_along<W, 1>(block + row, ld, columns, x, y, square_x, square_y);
  out[0] = sum_of(square_x);
  out[1] = sum_of(square_y);
}

template <int W>
FASTCAL_INLINE void parts_lanes(const double* block, int ld, int stride, int parts, int columns, const double* turn,
                                double* out) {
  using Lane = typename Vectors<W>::Lane;
  for (int k = 0; k < columns; ++k, block += ld, out += ld) {
    for (int row = 0; row < stride; row += W) {
      Lane sum = {}, b, t;
      for (int n = 0; n < parts; ++n) {
        load(b, block + n * stride + row);
        load(t, turn + n * stride + row);
        sum += t * b;
      }
      store(out + row, sum);
    }
  }
}

/// Reflects N columns: w = c (u_0 R_k + u^T B), R_k -= w u_0, B -= w u.
template <int W, int N>
FASTCAL_INLINE void reflect(const double* u, double u_0, double c, double* const* B, double* const* R, int rows) {
  using Lane = typename Vectors<W>::Lane;
  Lane sums[N] = {}, x, b;
  for (int row = 0; row < rows; row += W) {
    load(x, u + row);
    for (int k = 0; k < N; ++k) {
      load(b, B[k] + row);
      sums[k] += x * b;
    }
  }
  double w[N];
  for (int k = 0; k < N; ++k) {
    w[k] = c * (u_0 * *R[k] + sum_of(sums[k]));
    *R[k] -= w[k] * u_0;
  }
  for (int row = 0; row < rows; row += W) {
    load(x, u + row);
    for (int k = 0; k < N; ++k) {
      load(b, B[k] + row);
      b -= w[k] * x;
      store(B[k] + row, b);
    }
  }
}

template <int W>
FASTCAL_INLINE void triangle_lanes(double* block, int ld, int rows, int columns, double* R) {
  using Lane = typename Vectors<W>::Lane;
  for (int k = 0; k < columns; ++k) {
    double* u = block + static_cast<long>(k) * ld;
    Lane square = {}, x;
    for (int row = 0; row < rows; row += W) {
      load(x, u + row);
      square += x * x;
    }
    const double below = sum_of(square);
    if (!(below > kNothing)) continue;
    double& diagonal = R[k * columns + k];
    const double length = std::sqrt(diagonal * diagonal + below);
    const double to = diagonal > 0 ? -length : length;
    const double u_0 = diagonal - to;
    const double c = -1 / (to * u_0);
    diagonal = to;
    double *B[kReflected], *R_k[kReflected];
    int j = k + 1;
    for (; j + kReflected <= columns; j += kReflected) {
      for (int n = 0; n < kReflected; ++n) {
        B[n] = block + static_cast<long>(j + n) * ld;
        R_k[n] = R + (j + n) * columns + k;
      }
      reflect<W, kReflected>(u, u_0, c, B, R_k, rows);
    }
    for (; j + 2 <= columns; j += 2) {
      for (int n = 0; n < 2; ++n) {
        B[n] = block + static_cast<long>(j + n) * ld;
        R_k[n] = R + (j + n) * columns + k;
      }
      reflect<W, 2>(u, u_0, c, B, R_k, rows);
    }
    for (; j < columns; ++j) {
      B[0] = block + static_cast<long>(j) * ld;
      R_k[0] = R + j * columns + k;
      reflect<W, 1>(u, u_0, c, B, R_k, rows);
    }
  }
}

FASTCAL_FOR_EACH_SET(gram, gram_lanes, (const double* block, int ld, int rows, int columns, double* A),
                     (block, ld, rows, columns, A))
FASTCAL_FOR_EACH_SET(along, along_lanes,
                     (const double* block, int ld, int rows, int columns, const double* x, const double* y,
                      double* out),
                     (block, ld, rows, columns, x, y, out))
FASTCAL_FOR_EACH_SET(parts, parts_lanes,
                     (const double* block, int ld, int stride, int parts, int columns, const double* turn, double* out),
                     (block, ld, stride, parts, columns, turn, out))
FASTCAL_FOR_EACH_SET(triangle, triangle_lanes, (double* block, int ld, int rows, int columns, double* R),
                     (block, ld, rows, columns, R))

}  // namespace

void gram(const double* block, int ld, int rows, int columns, double* A) {
  static const auto run = FASTCAL_BEST_SET(gram);
  run(block, ld, rows, columns, A);
}

void squares_along(const double* block, int ld, int rows, int columns, const double* x, const double* y,
                   double out[2]) {
  static const auto run = FASTCAL_BEST_SET(along);
  run(block, ld, rows, columns, x, y, out);
}

void add_parts(const double* block, int ld, int stride, int parts, int columns, const double* turn, double* out) {
  static const auto run = FASTCAL_BEST_SET(parts);
  run(block, ld, stride, parts, columns, turn, out);
}

void update_triangle(double* block, int ld, int rows, int columns, double* R) {
  static const auto run = FASTCAL_BEST_SET(triangle);
  run(block, ld, rows, columns, R);
}

}  // namespace fastcal::kernels
