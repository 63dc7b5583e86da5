// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The sums of a block against plain matrix algebra.
#include "fastcal/kernels/normal_sums.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <vector>

#include "support/random.hpp"

namespace fastcal {
namespace {

using test::Random;

Eigen::MatrixXd block_of(Random& random, int ld, int rows, int columns) {
  Eigen::MatrixXd block = Eigen::MatrixXd::Constant(ld, columns, 1e300);  // what lies between columns is not read
  block.topRows(rows) = Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.uniform(-1, 1); });
  return block;
}

TEST(AddGram, AddsTheProductOfTheBlockWithItself) {
  Random random(1);
  for (const int columns : {1, 3, 4, 5, 34}) {
    for (const int rows : {8, 64, 384}) {
      const Eigen::MatrixXd block = block_of(random, rows + 8, rows, columns);
      Eigen::MatrixXd A = Eigen::MatrixXd::Identity(columns, columns);
      kernels::add_gram(block.data(), rows + 8, rows, columns, A.data());
      const Eigen::MatrixXd B = block.topRows(rows);
      const Eigen::MatrixXd wanted =
          (Eigen::MatrixXd::Identity(columns, columns) + B.transpose() * B).triangularView<Eigen::Upper>();
      EXPECT_LT((A - wanted).norm(), 1e-13 * wanted.norm()) << columns << " columns, " << rows << " rows";
    }
  }
}

TEST(AddGram, OfSomeColumnsLeavesTheOthersAlone) {
  Random random(5);
  constexpr int kColumns = 13, kRows = 2056;  // more than stay in the cache
  const std::vector<int> some{0, 2, 3, 7, 8, 12};
  const Eigen::MatrixXd block = block_of(random, kRows + 8, kRows, kColumns);
  Eigen::MatrixXd A = Eigen::MatrixXd::Ones(kColumns, kColumns);
  kernels::add_gram(block.data(), kRows + 8, kRows, some.data(), static_cast<int>(some.size()), kColumns, A.data());
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Ones(kColumns, kColumns);
  for (const int i : some) {
    for (const int j : some) {
      if (i <= j) wanted(i, j) += block.col(i).head(kRows).dot(block.col(j).head(kRows));
    }
  }
  EXPECT_LT((A - wanted).cwiseAbs().maxCoeff(), 1e-13 * kRows);
}

TEST(AddSquaresAlong, AddsThoseOfTheBlockTimesEachDirection) {
  Random random(4);
  for (const int columns : {1, 5, 40}) {
    for (const int rows : {8, 40, 384}) {
      const Eigen::MatrixXd block = block_of(random, rows + 8, rows, columns);
      const Eigen::MatrixXd directions =
          Eigen::MatrixXd::NullaryExpr(columns, 2, [&] { return random.uniform(-1, 1); });
      Eigen::Vector2d out(1, 2);
      kernels::add_squares_along(block.data(), rows + 8, rows, columns, directions.col(0).data(),
                                 directions.col(1).data(), out.data());
      const Eigen::MatrixXd along = block.topRows(rows) * directions;
      for (int d = 0; d < 2; ++d)
        EXPECT_NEAR(out[d], d + 1 + along.col(d).squaredNorm(), 1e-13 * rows * columns)
            << columns << " columns, " << rows;
    }
  }
}

TEST(AddParts, SumsTheRowsOfEachColumnThatLieAStrideApart) {
  Random random(3);
  for (const int columns : {1, 5}) {
    for (const int parts : {1, 3}) {
      constexpr int kStride = 24;
      const int rows = parts * kStride;
      const Eigen::MatrixXd block = block_of(random, rows + 8, rows, columns);
      const Eigen::VectorXd turn = Eigen::VectorXd::NullaryExpr(rows, [&] { return random.uniform(-1, 1); });
      Eigen::MatrixXd out = Eigen::MatrixXd::Constant(rows + 8, columns, 7);
      kernels::add_parts(block.data(), rows + 8, kStride, parts, columns, turn.data(), out.data());
      for (int k = 0; k < columns; ++k) {
        for (int i = 0; i < kStride; ++i) {
          double wanted = 0;
          for (int n = 0; n < parts; ++n) wanted += turn[n * kStride + i] * block(n * kStride + i, k);
          EXPECT_NEAR(out(i, k), wanted, 1e-15 * parts);
        }
      }
      EXPECT_TRUE((out.bottomRows(rows + 8 - kStride).array() == 7).all());
    }
  }
}

TEST(UpdateTriangle, KeepsSmallSingularValuesThatTheGramMatrixLoses) {
  Random random(2);
  constexpr int kColumns = 13;
  Eigen::MatrixXd all(4 * 48, kColumns);
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(kColumns, kColumns);
  for (int part = 0; part < 4; ++part) {
    Eigen::MatrixXd block = block_of(random, 56, 48, kColumns);
    block.col(6) = block.col(2) + 1e-12 * block.col(6);  // nearly dependent,
    block.col(9).setZero();                              // nothing at all,
    block.col(11) = block.col(3) - block.col(4);         // and wholly so
    all.middleRows(48 * part, 48) = block.topRows(48);
    kernels::update_triangle(block.data(), 56, 48, kColumns, R.data());
  }
  EXPECT_TRUE(R.isUpperTriangular(0));
  EXPECT_LT((R.transpose() * R - all.transpose() * all).norm(), 1e-13 * all.squaredNorm());
  const Eigen::VectorXd found = R.jacobiSvd().singularValues();
  const Eigen::VectorXd wanted = all.jacobiSvd().singularValues();
  EXPECT_LT((found - wanted).cwiseAbs().maxCoeff(), 1e-14 * wanted[0]);
  EXPECT_NEAR(found[kColumns - 3] / wanted[kColumns - 3], 1, 1e-2) << "1e-12 of the largest";
}

}  // namespace
}  // namespace fastcal
