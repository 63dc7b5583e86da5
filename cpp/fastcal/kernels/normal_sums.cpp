// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/normal_sums.hpp"

#include <cmath>

#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/kernels/lanes.hpp"

namespace fastcal::kernels {
namespace {

constexpr int kTile = 4;             // columns of a product that are summed at once,
constexpr int kNarrowTile = 3;       // with as many others: their sums and factors fill sixteen registers
constexpr int kGramRows = 1024;      // whose columns stay in the second-level cache while they meet each other
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
FASTCAL_INLINE void gram_lanes(const double* block, int ld, int rows, const int* columns, int count, int size,
                               double* A) {
  using Lane = typename Vectors<W>::Lane;
  constexpr int kLeft = W == 4 ? kNarrowTile : kTile;
  const auto place = [columns](int k) { return static_cast<long>(columns == nullptr ? k : columns[k]); };
  for (int from = 0; from < rows; from += kGramRows) {
    const int end = from + kGramRows < rows ? from + kGramRows : rows;
    for (int j = 0; j < count; j += kTile) {
      for (int i = 0; i < j + kTile && i < count; i += kLeft) {
        // At the edge the last column is taken again, unheard.
        const auto column = [=](int k) { return block + place(k < count ? k : count - 1) * ld; };
        const double *left[kLeft], *right[kTile];
        for (int k = 0; k < kLeft; ++k) left[k] = column(i + k);
        for (int k = 0; k < kTile; ++k) right[k] = column(j + k);
        Lane sums[kLeft][kTile] = {};
        for (int row = from; row < end; row += W) {
          Lane a[kLeft], b;
          for (int k = 0; k < kLeft; ++k) load(a[k], left[k] + row);
          for (int c = 0; c < kTile; ++c) {
            load(b, right[c] + row);
            for (int k = 0; k < kLeft; ++k) sums[k][c] += a[k] * b;
          }
        }
        for (int c = 0; c < kTile && j + c < count; ++c) {
          for (int k = 0; k < kLeft && i + k <= j + c; ++k) A[place(j + c) * size + place(i + k)] += sum_of(sums[k][c]);
        }
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
  out[0] += sum_of(square_x);
  out[1] += sum_of(square_y);
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

/// A Householder reflection I - c u u^T of a row of R and the block below it.
struct Reflection {
  int row;          // of R
  const double* u;  // in the block
  double u_0;       // in R
  double c;
};

/// The reflection that clears column k; false where nothing is below R.
template <int W>
FASTCAL_INLINE bool clear_column(const double* block, int ld, int rows, int columns, int k, double* R,
                                 Reflection& out) {
  const double* u = block + static_cast<long>(k) * ld;
  typename Vectors<W>::Lane square = {}, x;
  for (int row = 0; row < rows; row += W) {
    load(x, u + row);
    square += x * x;
  }
  const double below = sum_of(square);
  if (!(below > kNothing)) return false;
  double& diagonal = R[k * columns + k];
  const double length = std::sqrt(diagonal * diagonal + below);
  const double to = diagonal > 0 ? -length : length;
  const double u_0 = diagonal - to;
  out = {k, u, u_0, -1 / (to * u_0)};
  diagonal = to;
  return true;
}

/// Reflects N columns from the j-th on, once or twice: w = c (u_0 R_k + u^T B), R_k -= w u_0, B -= w u. Two at once
/// read and write the block once: the second's u^T (B - w u') is u^T B - w u^T u'.
template <int W, int N, int Count>
FASTCAL_INLINE void reflect(const Reflection* by, double across, double* block, int ld, int rows, int columns, int j,
                            double* R) {
  using Lane = typename Vectors<W>::Lane;
  double* B[N];
  for (int n = 0; n < N; ++n) B[n] = block + static_cast<long>(j + n) * ld;
  Lane sums[Count][N] = {}, x[Count], b;
  for (int row = 0; row < rows; row += W) {
    for (int m = 0; m < Count; ++m) load(x[m], by[m].u + row);
    for (int n = 0; n < N; ++n) {
      load(b, B[n] + row);
      for (int m = 0; m < Count; ++m) sums[m][n] += x[m] * b;
    }
  }
  double w[Count][N];
  for (int n = 0; n < N; ++n) {
    for (int m = 0; m < Count; ++m) {
      double& above = R[(j + n) * columns + by[m].row];
      w[m][n] = by[m].c * (by[m].u_0 * above + sum_of(sums[m][n]) - (m > 0 ? w[0][n] * across : 0.0));
      above -= w[m][n] * by[m].u_0;
    }
  }
  for (int row = 0; row < rows; row += W) {
    for (int m = 0; m < Count; ++m) load(x[m], by[m].u + row);
    for (int n = 0; n < N; ++n) {
      load(b, B[n] + row);
      for (int m = 0; m < Count; ++m) b -= w[m][n] * x[m];
      store(B[n] + row, b);
    }
  }
}

template <int W, int N, int Count>
FASTCAL_INLINE void reflect_all(const Reflection* by, double across, double* block, int ld, int rows, int columns,
                                int first, double* R) {
  int j = first;
  for (; j + N <= columns; j += N) reflect<W, N, Count>(by, across, block, ld, rows, columns, j, R);
  for (; j + 2 <= columns; j += 2) reflect<W, 2, Count>(by, across, block, ld, rows, columns, j, R);
  if (j < columns) reflect<W, 1, Count>(by, across, block, ld, rows, columns, j, R);
}

template <int W>
FASTCAL_INLINE void triangle_lanes(double* block, int ld, int rows, int columns, double* R) {
  for (int k = 0; k < columns; ++k) {
    Reflection two[2];
    if (!clear_column<W>(block, ld, rows, columns, k, R, two[0])) continue;
    if (k + 1 == columns) break;
    reflect<W, 1, 1>(two, 0, block, ld, rows, columns, k + 1, R);
    if (!clear_column<W>(block, ld, rows, columns, k + 1, R, two[1])) {
      reflect_all<W, kReflected, 1>(two, 0, block, ld, rows, columns, k + 2, R);
      ++k;
      continue;
    }
    typename Vectors<W>::Lane sum = {}, x, y;
    for (int row = 0; row < rows; row += W) {
      load(x, two[0].u + row);
      load(y, two[1].u + row);
      sum += x * y;
    }
    reflect_all<W, kReflected / 2, 2>(two, sum_of(sum), block, ld, rows, columns, k + 2, R);
    ++k;
  }
}

FASTCAL_FOR_EACH_SET(gram, gram_lanes,
                     (const double* block, int ld, int rows, const int* columns, int count, int size, double* A),
                     (block, ld, rows, columns, count, size, A))
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

void add_gram(const double* block, int ld, int rows, const int* columns, int count, int size, double* A) {
  static const auto run = FASTCAL_BEST_SET(gram);
  run(block, ld, rows, columns, count, size, A);
}

void add_gram(const double* block, int ld, int rows, int columns, double* A) {
  add_gram(block, ld, rows, nullptr, columns, columns, A);
}

void add_squares_along(const double* block, int ld, int rows, int columns, const double* x, const double* y,
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
