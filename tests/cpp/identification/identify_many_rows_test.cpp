// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows enough that some of them stand for all: a start, a gauge and a factor that must be those of all rows.
#include <gtest/gtest.h>

#include "fastcal/identification/identify.hpp"
#include "fastcal/identification/reduced_problem.hpp"
#include "identification/scene.hpp"

namespace fastcal::test {
namespace {

/// Sums at the solution, over the free parameters in units of their deviations.
NormalEquations sums_at(const Scene& s, const Identification& result) {
  const Eigen::VectorXd deviation = result.covariance.diagonal().cwiseSqrt();
  return normal_equations({s.model, s.samples, s.measured}, result.theta, result.free, deviation,
                          {result.tau, result.loss}, true);
}

TEST(Identify, TheMinimumIsReachedHoweverManyRowsThereAre) {
  for (const Eigen::Index rows : {60, 1000, 12'000}) {
    for (const LossKind loss : {LossKind::kNone, LossKind::kTukey, LossKind::kHuber, LossKind::kCauchy}) {
      Scene s = scene(41, What::kPositions, rows, {5e-5, 0});
      for (Eigen::Index i = 0; i < rows; i += 20) s.measured.position(i, i % 3) += 4e-4;
      const Identification result = s.identified(with(loss));
      ASSERT_EQ(result.status, Status::kConverged) << result.message;
      expect_finite(result);
      EXPECT_LT(root_at(sums_at(s, result)).turned.norm(), 2e-7) << rows << " rows, " << loss_name(loss);
    }
  }
}

TEST(Identify, TheCovarianceOfManyRowsIsThatOfAllOfThem) {
  const Scene s = scene(42, What::kPositions, 1000, {5e-5, 0});
  const Identification result = s.identified(with(LossKind::kNone));
  const Eigen::VectorXd deviation = result.covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd correlation =
      deviation.cwiseInverse().asDiagonal() * result.covariance * deviation.cwiseInverse().asDiagonal();
  const NormalEquations sums = sums_at(s, result);
  const double variance = 2 * sums.cost / result.degrees_of_freedom;
  EXPECT_LT((correlation - variance * sums.A.inverse()).norm(), 1e-6 * correlation.norm());
}

// Joint 3 moves in six rows of 1,200, none of which is among those that stand for all.
TEST(Identify, WhatFewRowsAloneShowIsFree) {
  Scene s = scene(43, What::kPositions, 1200, {5e-5, 0});
  const Eigen::VectorXd moves = s.samples.q.table().col(2);
  s.samples.q.own().col(2).setConstant(0.4);
  Random random(44);
  s.measured = measure(random, s.model, s.samples, s.truth, What::kPositions, {5e-5, 0});
  const Identification still = s.identified();
  for (const Eigen::Index i : {0, 1, 4, 5, 9, 13}) s.samples.q.own()(i, 2) = moves[i];
  s.measured = measure(random, s.model, s.samples, s.truth, What::kPositions, {5e-5, 0});
  const Identification result = s.identified();
  ASSERT_EQ(result.status, Status::kConverged) << result.message;
  EXPECT_EQ(result.rank, 27);
  EXPECT_EQ(result.free.size(), 27U);
  EXPECT_LT(still.free.size(), 27U);
  // As sure of it as these rows make it, and right.
  Samples elsewhere = test::postures(random, 100, 6);
  EXPECT_LT(test::rms_distance(s.model, elsewhere, result.theta, s.truth), 2e-4);
}

TEST(Identify, ManyRowsGiveTheSameBitsOnAnyNumberOfThreads) {
  for (const Eigen::Index rows : {3000, 12'000}) {
    Scene s = scene(45, What::kPositions, rows, {5e-5, 0});
    for (Eigen::Index i = 0; i < rows; i += 20) s.measured.position(i, i % 3) += 4e-4;
    const Identification alone = s.identified();
    for (const int threads : {2, 3, 8}) {
      const Identification result = s.identified({}, threads);
      EXPECT_EQ(result.theta, alone.theta) << threads;
      EXPECT_EQ(result.covariance, alone.covariance) << threads;
    }
  }
}

}  // namespace
}  // namespace fastcal::test
