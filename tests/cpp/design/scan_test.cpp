// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What a scan keeps up to date by rank-k changes is what linear algebra says from the start.
#include "fastcal/design/scan.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace fastcal::design {
namespace {

constexpr int kCandidates = 37;  // not a multiple of the lanes
constexpr int kParameters = 8;

RowMatrixXd random_rows(int rows, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return RowMatrixXd::NullaryExpr(kCandidates * rows, kParameters, [&] { return normal(random); });
}

double log_determinant(const Eigen::MatrixXd& M) { return std::log(M.determinant()); }

class ScanTest : public ::testing::TestWithParam<int> {
 protected:
  const int rows_ = GetParam();
  const RowMatrixXd J_ = random_rows(rows_, 1);
  const Candidates candidates_{J_, rows_};
  const Eigen::MatrixXd start_ = 0.1 * Eigen::MatrixXd::Identity(kParameters, kParameters);

  Eigen::MatrixXd own(Eigen::Index c) const {
    const Eigen::MatrixXd J = J_.middleRows(c * rows_, rows_);
    return J.transpose() * J;
  }
  /// Adds and takes away; returns M.
  Eigen::MatrixXd walk(Scan& scan) const {
    Eigen::MatrixXd M = start_;
    scan.restart(M);
    for (const Eigen::Index c : {3, 36, 12, 20, 7, 0, 3}) {
      scan.add(c);
      M += own(c);
    }
    for (const Eigen::Index c : {12, 0}) {
      scan.remove(c);
      M -= own(c);
    }
    return M;
  }
};

TEST_P(ScanTest, DeterminantAndItsGainsAreThoseOfTheMatrix) {
  DeterminantScan scan(candidates_, 2);
  const Eigen::MatrixXd M = walk(scan);
  EXPECT_NEAR(scan.value(), log_determinant(M), 1e-10);
  EXPECT_LT((scan.covariance() - M.inverse()).cwiseAbs().maxCoeff(), 1e-10);
  const Eigen::VectorXd gains = scan.gains();
  const Eigen::VectorXd sensitivities = scan.sensitivities();
  for (Eigen::Index c = 0; c < kCandidates; ++c) {
    EXPECT_NEAR(gains[c], log_determinant(M + own(c)) - log_determinant(M), 1e-9);
    EXPECT_NEAR(sensitivities[c], (M.inverse() * own(c)).trace(), 1e-9);
  }
  EXPECT_NEAR(scan.gain_of_removing(36), log_determinant(M - own(36)) - log_determinant(M), 1e-9);
}

TEST_P(ScanTest, VarianceAndItsGainsAreThoseOfTheMatrix) {
  const RowMatrixXd targets = random_rows(rows_, 2);
  const Eigen::MatrixXd B = targets.transpose() * targets / kCandidates;
  const auto variance = [&](const Eigen::MatrixXd& M) { return (M.inverse() * B).trace(); };
  VarianceScan scan(candidates_, B, 1);
  const Eigen::MatrixXd M = walk(scan);
  EXPECT_NEAR(scan.value(), -variance(M), 1e-9);
  const Eigen::VectorXd gains = scan.gains();
  for (Eigen::Index c = 0; c < kCandidates; ++c) EXPECT_NEAR(gains[c], variance(M) - variance(M + own(c)), 1e-9);
  EXPECT_NEAR(scan.gain_of_removing(36), variance(M) - variance(M - own(36)), 1e-8);
}

INSTANTIATE_TEST_SUITE_P(RowCounts, ScanTest, ::testing::Values(1, 2, 3, 6));

TEST(Candidates, ProductsAndBlocksAreThoseOfTheRows) {
  const RowMatrixXd J = random_rows(3, 3);
  const Candidates candidates(J, 3);
  const Eigen::MatrixXd U = random_rows(1, 4).topRows(11).transpose();  // eleven columns: two tiles
  const Eigen::MatrixXd expected = J * U;
  Eigen::MatrixXd found(J.rows(), U.cols());
  candidates.multiply(U, 2, [&](Eigen::Index block, const Lane* X) {
    for (Eigen::Index lane = 0; lane < kLanes && block * kLanes + lane < kCandidates; ++lane) {
      for (Eigen::Index i = 0; i < 3 * U.cols(); ++i) {
        found((block * kLanes + lane) * 3 + i / U.cols(), i % U.cols()) = X[i][lane];
      }
    }
  });
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-12);
  const Candidates some = candidates.subset({36, 5});
  EXPECT_EQ(some.block(0), candidates.block(36));
  EXPECT_EQ(some.block(1), Eigen::MatrixXd(J.middleRows(15, 3)));
}

}  // namespace
}  // namespace fastcal::design
