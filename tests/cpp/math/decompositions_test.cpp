// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/decompositions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <random>

namespace fastcal {
namespace {

TEST(Decompositions, RightSvdOfTriangularFactorsWithNullSpaces) {
  // As an identification has them: columns of very different size, some of them combinations of others.
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 200; ++round) {
    const Eigen::Index columns = 4 + round % 41;
    const Eigen::Index rank = columns - round % 7 % columns;
    Eigen::MatrixXd J(3 * columns, columns);
    for (Eigen::Index k = 0; k < columns; ++k) {
      for (Eigen::Index i = 0; i < J.rows(); ++i) J(i, k) = std::exp(2 * normal(generator)) * normal(generator);
      if (k >= rank) J.col(k) = J.col(k - rank) - 0.3 * J.col(0);
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(J);
    const Eigen::MatrixXd R = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
    const RightSvd found = right_svd(R);
    const double largest = found.values[0];
    EXPECT_TRUE((found.V.transpose() * found.V).isIdentity(1e-12));
    for (Eigen::Index k = 0; k < columns; ++k) {
      EXPECT_NEAR((R * found.V.col(k)).norm(), found.values[k], 1e-13 * largest);
      if (k > 0) {
        EXPECT_LE(found.values[k], found.values[k - 1]);
      }
      if (k >= rank) {
        EXPECT_LT(found.values[k], 1e-13 * largest);
      }
    }
    const Eigen::VectorXd squares =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(R.transpose() * R).eigenvalues().reverse();
    for (Eigen::Index k = 0; k < rank; ++k)
      EXPECT_NEAR(found.values[k] * found.values[k], squares[k], 1e-12 * largest * largest);
  }
}

TEST(Decompositions, InverseOfLowerLooksAtTheTriangleAlone) {
  std::mt19937 generator(6);
  std::normal_distribution<double> normal;
  for (const Eigen::Index p : {1, 2, 7, 40}) {
    const Eigen::MatrixXd any = Eigen::MatrixXd::NullaryExpr(p, p, [&] { return normal(generator); });
    Eigen::MatrixXd L = any.triangularView<Eigen::StrictlyLower>();
    L.diagonal().setConstant(3);
    Eigen::MatrixXd filled = any;
    filled.triangularView<Eigen::Lower>() = L;
    const Eigen::MatrixXd inverse = inverse_of_lower(filled);
    EXPECT_TRUE(inverse.transpose().isUpperTriangular(0));
    EXPECT_TRUE((L * inverse).isIdentity(1e-12 * inverse.norm())) << p;
  }
  EXPECT_EQ(inverse_of_lower(Eigen::MatrixXd(0, 0)).size(), 0);
}

TEST(Decompositions, RightSvdOfWideAndOfBadMatrices) {
  const RightSvd wide = right_svd(Eigen::MatrixXd{{3.0, 0.0, 4.0}});
  ASSERT_EQ(wide.values.size(), 1);
  EXPECT_NEAR(wide.values[0], 5, 1e-15);
  EXPECT_NEAR(std::abs(wide.V(0, 0)), 0.6, 1e-15);
  EXPECT_TRUE((wide.V.transpose() * wide.V).isIdentity(1e-14));
  Eigen::MatrixXd bad = Eigen::MatrixXd::Identity(3, 3);
  bad(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(right_svd(bad).values.array().isNaN().all());
}

}  // namespace
}  // namespace fastcal
