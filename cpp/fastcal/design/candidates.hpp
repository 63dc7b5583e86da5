// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What could be measured: candidate c gives k numbers whose derivatives by the parameters are the rows of J_c (k x p),
// divided by their standard deviations, columns scaled. A search multiplies all J_c by a few columns, again and again,
// and that is a matter of memory: four candidates lie side by side, so that one pass reads each number once.
#pragma once

#include <vector>

#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/math/types.hpp"

namespace fastcal::design {

constexpr int kLanes = 4;
constexpr int kMostRows = 24;  ///< k: a point has 3, a pose 6, each level 2 more, a touch 1

/// One number of each of four candidates.
using Lane __attribute__((vector_size(kLanes * sizeof(double)), aligned(sizeof(double)), may_alias)) = double;

class Candidates {
 public:
  /// `J` (N k, p), the k rows of a candidate one after the other. Throws InvalidInput where a number is not finite.
  Candidates(const Eigen::Ref<const RowMatrixXd>& J, int rows);

  Eigen::Index count() const { return count_; }
  int rows() const { return rows_; }
  Eigen::Index columns() const { return columns_; }
  Eigen::Index blocks() const { return (count_ + kLanes - 1) / kLanes; }

  /// J_c (k, p).
  Eigen::MatrixXd block(Eigen::Index candidate) const;
  /// Those candidates alone, in the order given.
  Candidates subset(const std::vector<Eigen::Index>& chosen) const;
  /// sum J_c^T J_c over the candidates given.
  Eigen::MatrixXd information(const std::vector<Eigen::Index>& chosen) const;

  /// Calls body(block, X) for each block of four: X[row * m + column] is that number of J_c U, U (p, m), lane by lane.
  template <typename Body>
  void multiply(const Eigen::MatrixXd& U, int threads, const Body& body) const;

 private:
  Candidates(Eigen::Index count, int rows, Eigen::Index columns);
  double& at(Eigen::Index candidate, int row, Eigen::Index column) {
    return values_[static_cast<std::size_t>((((candidate / kLanes) * rows_ + row) * columns_ + column) * kLanes +
                                            candidate % kLanes)];
  }
  double at(Eigen::Index candidate, int row, Eigen::Index column) const {
    return const_cast<Candidates*>(this)->at(candidate, row, column);
  }

  Eigen::Index count_ = 0;
  int rows_ = 0;
  Eigen::Index columns_ = 0;
  std::vector<double> values_;  // (blocks, rows, columns, lanes); lanes beyond the last candidate hold 0
};

namespace internal {

constexpr int kTile = 6;  // columns of U at a time: twelve accumulators of two doubles are all that SSE2 has room for

/// x[0 ... M - 1] = sum_j a[j] u[j M ... j M + M - 1].
template <int M>
void multiply_row(const double* a, Eigen::Index columns, const double* u, Lane* x) {
  Lane sum[M] = {};  // a plain array: as an argument of std::array, Lane would lose its alignment
  for (Eigen::Index j = 0; j < columns; ++j) {
    const Lane value = *reinterpret_cast<const Lane*>(a + j * kLanes);
    for (int m = 0; m < M; ++m) sum[m] += value * u[j * M + m];
  }
  for (int m = 0; m < M; ++m) x[m] = sum[m];
}

/// The same for 1 to kTile columns.
inline void multiply_row(Eigen::Index m, const double* a, Eigen::Index columns, const double* u, Lane* x) {
  switch (m) {
    case 1:
      return multiply_row<1>(a, columns, u, x);
    case 2:
      return multiply_row<2>(a, columns, u, x);
    case 3:
      return multiply_row<3>(a, columns, u, x);
    case 4:
      return multiply_row<4>(a, columns, u, x);
    case 5:
      return multiply_row<5>(a, columns, u, x);
    default:
      return multiply_row<kTile>(a, columns, u, x);
  }
}

}  // namespace internal

template <typename Body>
void Candidates::multiply(const Eigen::MatrixXd& U, int threads, const Body& body) const {
  using internal::kTile;
  const Eigen::Index m = U.cols();
  std::vector<RowMatrixXd> tiles;
  for (Eigen::Index first = 0; first < m; first += kTile) {
    tiles.emplace_back(U.middleCols(first, std::min<Eigen::Index>(kTile, m - first)));
  }
  parallel_chunks(blocks(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    std::vector<double> storage(static_cast<std::size_t>(rows_ * m * kLanes));
    Lane* X = reinterpret_cast<Lane*>(storage.data());
    for (Eigen::Index block = begin; block < end; ++block) {
      for (int row = 0; row < rows_; ++row) {
        const double* a = values_.data() + (block * rows_ + row) * columns_ * kLanes;
        for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
          internal::multiply_row(tiles[tile].cols(), a, columns_, tiles[tile].data(),
                                 X + row * m + static_cast<Eigen::Index>(tile) * kTile);
        }
      }
      body(block, X);
    }
  });
}

}  // namespace fastcal::design
