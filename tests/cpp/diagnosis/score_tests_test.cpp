// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A score test of a block equals the fall of chi square where the block is really fitted as well (Frisch, Waugh and
// Lovell): every number is held against whole least-squares fits by an SVD, and against projections written out.
#include "fastcal/diagnosis/score_tests.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "fastcal/math/check.hpp"
#include "support/random.hpp"

namespace fastcal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::Random;

MatrixXd matrix(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

MatrixXd beside(const MatrixXd& A, const MatrixXd& B) {
  MatrixXd out(A.rows(), A.cols() + B.cols());
  out << A, B;
  return out;
}

/// |r - X b|^2 of the best b.
double left_by(const MatrixXd& X, const VectorXd& r) {
  const Eigen::JacobiSVD<MatrixXd> svd(X, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return (r - X * svd.solve(r)).squaredNorm();
}

/// P X: what the columns of A can't take up.
MatrixXd beyond(const MatrixXd& A, const MatrixXd& X) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return X - A * svd.solve(X);
}

/// Sixty numbers, five fitted parameters, blocks of 1, 3, 2 and 6 columns of which the third leans on the first.
struct Case {
  explicit Case(std::uint64_t seed = 1) : random(seed) {
    A = matrix(random, 60, 5);
    C = matrix(random, 60, 12);
    C.col(4) += 2 * C.col(0) + A.col(1);
    r = matrix(random, 60, 1) + 0.6 * C.col(0) - 0.3 * C.col(7);
  }
  MatrixXd block(int i) const {
    return C.middleCols(first[static_cast<std::size_t>(i)], sizes[static_cast<std::size_t>(i)]);
  }
  ScoreTests tests() const { return {A, C, r, sizes}; }

  Random random;
  std::vector<int> sizes{1, 3, 2, 6};
  std::vector<int> first{0, 1, 4, 6};
  MatrixXd A, C;
  VectorXd r;
};

TEST(ScoreTests, StatisticIsWhatTheFitGainsWhenTheBlockIsAdded) {
  const Case c;
  const ScoreTests tests = c.tests();
  EXPECT_EQ(tests.block_count(), 4);
  EXPECT_EQ(tests.null_rank(), 5);
  EXPECT_NEAR(tests.remaining(), left_by(c.A, c.r), 1e-11);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(tests.scores().rank[i], c.sizes[static_cast<std::size_t>(i)]);
    EXPECT_NEAR(tests.scores().statistic[i], tests.remaining() - left_by(beside(c.A, c.block(i)), c.r), 1e-10);
  }
}

TEST(ScoreTests, EstimatesAndDeviationsAreThoseOfTheWholeFit) {
  const Case c;
  const ScoreTests tests = c.tests();
  for (int i = 0; i < 4; ++i) {
    const Index size = c.sizes[static_cast<std::size_t>(i)];
    const Index at = c.first[static_cast<std::size_t>(i)];
    const MatrixXd X = beside(c.A, c.block(i));
    const MatrixXd covariance = (X.transpose() * X).inverse();
    const VectorXd b = covariance * (X.transpose() * c.r);
    EXPECT_LT((tests.estimate().segment(at, size) - b.tail(size)).norm(), 1e-11);
    EXPECT_LT((tests.deviation().segment(at, size) - covariance.diagonal().tail(size).cwiseSqrt()).norm(), 1e-11);
  }
}

TEST(ScoreTests, LengthAndSurvivingShareAreThoseOfTheProjectedColumns) {
  const Case c;
  const ScoreTests tests = c.tests();
  const VectorXd length = beyond(c.A, c.C).colwise().norm();
  EXPECT_LT((tests.length() - length).norm(), 1e-11);
  for (int i = 0; i < 4; ++i) {
    const Index size = c.sizes[static_cast<std::size_t>(i)];
    const auto part = length.segment(c.first[static_cast<std::size_t>(i)], size);
    const VectorXd share = part.array() / c.block(i).colwise().norm().transpose().array();
    EXPECT_NEAR(tests.surviving()[i], std::sqrt(share.squaredNorm() / static_cast<double>(size)), 1e-12);
  }
}

TEST(ScoreTests, GivenIsTheGainOnTopOfWhatWasAdded) {
  const Case c;
  const ScoreTests tests = c.tests();
  for (const std::vector<int>& added :
       {std::vector<int>{0}, std::vector<int>{2, 1}, std::vector<int>{0, 2}, std::vector<int>{}}) {
    MatrixXd X = c.A;
    for (const int i : added) X = beside(X, c.block(i));
    const double before = left_by(X, c.r);
    int rank = 0;
    EXPECT_NEAR(tests.remaining_with(added, rank), before, 1e-10);
    EXPECT_EQ(rank, X.cols() - c.A.cols());
    const BlockScores left = tests.given(added);
    for (int k = 0; k < 4; ++k) {
      const bool in = std::find(added.begin(), added.end(), k) != added.end();
      EXPECT_EQ(left.rank[k], in ? 0 : c.sizes[static_cast<std::size_t>(k)]);
      EXPECT_NEAR(left.statistic[k], in ? 0 : before - left_by(beside(X, c.block(k)), c.r), 1e-9);
    }
  }
}

TEST(ScoreTests, CorrelationIsTheCosineOfTheSmallestAngleBeyondTheFit) {
  const Case c;
  const ScoreTests tests = c.tests();
  const MatrixXd correlation = tests.correlation({0, 1, 2, 3}, {0, 1, 2, 3});
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(correlation(i, i), 1, 1e-12);
    // Of one column: the root of the share of its square that the other block explains.
    const VectorXd x = beyond(c.A, c.block(0));
    const double share = 1 - left_by(beside(c.A, c.block(i)), x) / x.squaredNorm();
    EXPECT_NEAR(correlation(0, i), std::sqrt(share), 1e-11);
  }
  EXPECT_LT((correlation - correlation.transpose()).norm(), 1e-12);
}

TEST(ScoreTests, SharedIsWhatAnotherBlockExplainsOfTheFittedSignature) {
  const Case c;
  const MatrixXd shared = c.tests().shared({0, 1, 2, 3}, {0, 1, 2, 3});
  for (int i = 0; i < 4; ++i) {
    const MatrixXd own = beyond(c.A, c.block(i));
    const VectorXd signature = own * own.jacobiSvd(Eigen::ComputeThinU | Eigen::ComputeThinV).solve(c.r);
    for (int k = 0; k < 4; ++k) {
      const double left = left_by(beside(c.A, c.block(k)), signature);
      EXPECT_NEAR(shared(i, k), 1 - left / signature.squaredNorm(), 1e-11);
    }
  }
}

TEST(ScoreTests, ABlockThatTheFitHoldsIsAbsorbedAndSilent) {
  Case c;
  c.C.col(0) = c.A * VectorXd::LinSpaced(5, 1, 2);
  c.C.col(2).setZero();
  c.C.col(9) = c.C.col(8) + c.A.col(0);  // of six columns of the last block two are one beyond the fit
  const ScoreTests tests = c.tests();
  EXPECT_EQ(tests.scores().rank, Eigen::Vector4i(0, 2, 2, 5));
  EXPECT_EQ(tests.scores().statistic[0], 0);
  EXPECT_EQ(tests.estimate()[0], 0);
  EXPECT_LT(tests.surviving()[0], 1e-12);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(tests.deviation()[0], infinity);
  EXPECT_EQ(tests.deviation()[2], infinity);
  EXPECT_LT(tests.deviation()[1], 1);
  EXPECT_EQ(tests.deviation()[8], infinity);
  EXPECT_EQ(tests.deviation()[9], infinity);
  EXPECT_LT(tests.deviation()[10], 1);
  EXPECT_EQ(tests.correlation({0}, {1})(0, 0), 0);
  EXPECT_EQ(tests.given({1}).rank[0], 0);
  EXPECT_NEAR(tests.scores().statistic[3], tests.remaining() - left_by(beside(c.A, c.block(3)), c.r), 1e-10);
}

TEST(ScoreTests, AnExactTwinOfWhatIsAddedHasNothingToSay) {
  Case c;
  c.C.middleCols(4, 1) = 3 * c.C.col(0) - c.A.col(2);
  const ScoreTests tests = c.tests();
  EXPECT_NEAR(tests.correlation({0}, {2})(0, 0), 1, 1e-12);
  EXPECT_EQ(tests.given({0}).rank[2], 1);
  EXPECT_EQ(tests.given({2}).rank[0], 0);
  EXPECT_EQ(tests.given({2}).statistic[0], 0);
  int rank = 0;
  tests.remaining_with({0, 2}, rank);
  EXPECT_EQ(rank, 2);
}

TEST(ScoreTests, ARankLostInTheFitIsFoundWhateverTheUnits) {
  Case c;
  c.A.col(3) = 1e-9 * (c.A.col(0) + c.A.col(1));
  const ScoreTests tests = c.tests();
  EXPECT_EQ(tests.null_rank(), 4);
  EXPECT_NEAR(tests.remaining(), left_by(beside(c.A.leftCols(3), c.A.col(4)), c.r), 1e-10);
}

TEST(ScoreTests, UnitsOfTheColumnsChangeNothingButTheEstimates) {
  const Case c;
  Random random(4);
  const VectorXd units = VectorXd::NullaryExpr(12, [&] { return std::pow(10.0, random.uniform(-9, 6)); });
  const VectorXd own = VectorXd::NullaryExpr(5, [&] { return std::pow(10.0, random.uniform(-9, 6)); });
  const ScoreTests plain = c.tests();
  const ScoreTests turned(c.A * own.asDiagonal(), c.C * units.asDiagonal(), c.r, c.sizes);
  EXPECT_LT((plain.scores().statistic - turned.scores().statistic).norm(), 1e-9);
  EXPECT_LT((plain.surviving() - turned.surviving()).norm(), 1e-12);
  for (int k = 0; k < 12; ++k) {
    EXPECT_NEAR(turned.estimate()[k] * units[k], plain.estimate()[k], 1e-10);
    EXPECT_NEAR(turned.deviation()[k] * units[k], plain.deviation()[k], 1e-10);
    EXPECT_NEAR(turned.length()[k] / units[k], plain.length()[k], 1e-9);
  }
}

TEST(ScoreTests, APriorIsARowWithItsOwnEquation) {
  // Held to 0 +- s, a parameter takes up but a part: chi square is that of the penalized fit, by its normal equations.
  const Case c;
  const double s = 0.05;
  MatrixXd A = MatrixXd::Zero(61, 5);
  A.topRows(60) = c.A;
  A(60, 2) = 1 / s;
  MatrixXd C = MatrixXd::Zero(61, 12);
  C.topRows(60) = c.C;
  VectorXd r = VectorXd::Zero(61);
  r.head(60) = c.r;
  const ScoreTests tests(A, C, r, c.sizes);
  const auto penalized = [&](const MatrixXd& X) {
    MatrixXd N = X.transpose() * X;
    N(2, 2) += 1 / (s * s);
    const VectorXd g = X.transpose() * c.r;
    return c.r.squaredNorm() - g.dot(N.ldlt().solve(g));
  };
  EXPECT_NEAR(tests.remaining(), penalized(c.A), 1e-10);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(tests.scores().statistic[i], penalized(c.A) - penalized(beside(c.A, c.block(i))), 1e-9);
}

TEST(ScoreTests, AnyNumberOfThreadsFindsTheSameDetectableSizes) {
  std::srand(11);
  const std::vector<int> sizes(90, 3);
  const ScoreTests tests(MatrixXd::Random(400, 5), MatrixXd::Random(400, 270), VectorXd::Random(400), sizes);
  const VectorXd limits = VectorXd::Constant(90, 20);
  std::vector<int> columns(270);
  std::iota(columns.begin(), columns.end(), 0);
  const VectorXd alone = tests.detectable(columns, limits, 0.8, 100, 7);
  EXPECT_TRUE(alone.allFinite());
  for (const int threads : {2, 3, 8}) EXPECT_EQ(tests.detectable(columns, limits, 0.8, 100, 7, threads), alone);
}

TEST(ScoreTests, TheSameSeedGivesTheSameNumber) {
  const ScoreTests tests = Case().tests();
  const VectorXd limits = VectorXd::Constant(4, 20);
  EXPECT_EQ(tests.detectable({0, 1}, limits, 0.8, 100, 7), Case().tests().detectable({0, 1}, limits, 0.8, 100, 7));
  EXPECT_NE(tests.detectable({0, 1}, limits, 0.8, 100, 7), tests.detectable({0, 1}, limits, 0.8, 100, 8));
  EXPECT_EQ(tests.scores().statistic, Case().tests().scores().statistic);
}

TEST(ScoreTests, UnderNoiseAloneAStatisticIsChiSquareOfItsRank) {
  Case c;
  constexpr int kDraws = 400;
  VectorXd mean = VectorXd::Zero(4);
  for (int i = 0; i < kDraws; ++i) {
    c.r = matrix(c.random, 60, 1);
    mean += c.tests().scores().statistic / kDraws;
  }
  for (int i = 0; i < 4; ++i) {
    const double k = c.sizes[static_cast<std::size_t>(i)];
    EXPECT_NEAR(mean[i], k, 5 * std::sqrt(2 * k / kDraws));
  }
}

TEST(ScoreTests, ProjectedColumnsInFewerRowsGiveTheSame) {
  Case at;
  const ScoreTests rows = at.tests();
  const VectorXd length = at.C.colwise().norm();
  MatrixXd both(60, 13);
  both << beyond(at.A, at.C * length.cwiseInverse().asDiagonal()), beyond(at.A, at.r);
  const MatrixXd R = Eigen::HouseholderQR<MatrixXd>(both).matrixQR().topRows(13).triangularView<Eigen::Upper>();
  const ScoreTests few({R.leftCols(12), R.col(12), length, 5}, at.sizes);
  EXPECT_EQ(few.null_rank(), rows.null_rank());
  EXPECT_EQ(few.scores().rank, rows.scores().rank);
  EXPECT_TRUE(few.scores().statistic.isApprox(rows.scores().statistic, 1e-9));
  EXPECT_TRUE(few.estimate().isApprox(rows.estimate(), 1e-9));
  EXPECT_TRUE(few.deviation().isApprox(rows.deviation(), 1e-9));
  EXPECT_TRUE(few.length().isApprox(rows.length(), 1e-9));
  EXPECT_TRUE(few.given({1}).statistic.isApprox(rows.given({1}).statistic, 1e-9));
  EXPECT_NEAR(few.remaining(), rows.remaining(), 1e-9 * rows.remaining());
  EXPECT_THROW(ScoreTests({R.leftCols(11), R.col(12), length, 5}, at.sizes), InvalidInput);
}

TEST(ScoreTests, RefusesWhatDoesNotFitTogether) {
  const Case c;
  EXPECT_THROW(ScoreTests(c.A.topRows(59), c.C, c.r, c.sizes), InvalidInput);
  EXPECT_THROW(ScoreTests(c.A, c.C.topRows(59), c.r, c.sizes), InvalidInput);
  EXPECT_THROW(ScoreTests(c.A, c.C, c.r, {1, 3, 2}), InvalidInput);
  VectorXd r = c.r;
  r[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ScoreTests(c.A, c.C, r, c.sizes), InvalidInput);
  EXPECT_THROW(ScoreTests(c.A, c.C, c.r, {0, 12}), InvalidInput);
  EXPECT_THROW(ScoreTests(c.A, c.C, c.r, {-1, 13}), InvalidInput);
  const ScoreTests tests = c.tests();
  EXPECT_THROW(tests.given({4}), InvalidInput);
  EXPECT_THROW(tests.correlation({-1}, {0}), InvalidInput);
  EXPECT_THROW(tests.shared({0}, {9}), InvalidInput);
  EXPECT_THROW(tests.detectable({0}, VectorXd::Constant(4, 20), 0.8, 0, 0), InvalidInput);
}

}  // namespace
}  // namespace fastcal
