// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/loss.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/measurement/measurements.hpp"

namespace fastcal {
namespace {

constexpr LossKind kTuned[] = {LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey};
constexpr LossKind kAll[] = {LossKind::kNone, LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey,
                             LossKind::kDistance};

/// Mean of f(u^2) over the chi law of d components, by the midpoint rule.
template <typename F>
double mean(int d, const F& f) {
  constexpr double h = 1e-4;
  double sum = 0;
  for (double u = h / 2; u < 16; u += h) sum += std::pow(u, d - 1) * std::exp(-u * u / 2) * f(u * u);
  return sum * h / (std::pow(2, 0.5 * d - 1) * std::tgamma(0.5 * d));
}

// The constants that every textbook prints for one component and 95 % efficiency.
TEST(Loss, TuningForOneComponentIsTheTextbooks) {
  EXPECT_NEAR(tuned_loss(LossKind::kHuber, 1).tuning, 1.345, 5e-4);
  EXPECT_NEAR(tuned_loss(LossKind::kTukey, 1).tuning, 4.685, 5e-4);
  EXPECT_NEAR(tuned_loss(LossKind::kCauchy, 1).tuning, 2.3849, 5e-4);
}

TEST(Loss, EveryTuningIs95PercentEfficientAndUnbiasedAtTheNormalLaw) {
  for (const LossKind kind : kTuned) {
    for (int d = 1; d <= 7; ++d) {
      const Loss& loss = tuned_loss(kind, d);
      // psi(u) = w u / |u| |u|: A is the mean of div psi / d, here by Stein's identity that of psi u / d; B the mean of
      // psi^2 / d.
      const double a = mean(d, [&](double s) { return loss.weight(s) * s; }) / d;
      const double b = mean(d, [&](double s) { return loss.weight(s) * loss.weight(s) * s; }) / d;
      EXPECT_NEAR(a * a / b, 0.95, 1e-5) << "d = " << d;
      EXPECT_NEAR(loss.consistency, a, 1e-5) << "d = " << d;
      EXPECT_NEAR(loss.expectation, mean(d, [&](double s) { return loss.rho(s); }), 1e-5) << "d = " << d;
    }
  }
}

TEST(Loss, WeightIsTheDerivativeOfRhoAndSlopeThatOfTheWeight) {
  for (const LossKind kind : kAll) {
    const Loss& loss = tuned_loss(kind, 3);
    for (double u = 0.05; u < 3 * std::max(1.0, loss.tuning); u += 0.0937) {
      const double s = u * u;
      const double h = 1e-5 * u;
      EXPECT_NEAR(loss.weight(s), (loss.rho(s + h) - loss.rho(s - h)) / (2 * h), 1e-6 * (1 + loss.weight(s)))
          << "u = " << u;
      const double slope = u * (loss.weight((u + h) * (u + h)) - loss.weight((u - h) * (u - h))) / (2 * h);
      EXPECT_NEAR(loss.weight_slope(s), slope, 1e-6 * (1 + std::abs(slope))) << "u = " << u;
    }
  }
}

// What the reduction to p + 1 residuals rests on: rho is 0 at 0, grows, and is concave in u^2, so that rho >= w u^2.
TEST(Loss, TheSumIsThatOfEach) {
  const std::vector<double> squares{0, 0.3, 2, 7, 25, 40, 1000};
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey}) {
    const Loss& loss = tuned_loss(kind, 3);
    double sum = 0;
    for (const double square : squares) sum += loss.rho(0.8 * square);
    EXPECT_NEAR(loss.sum(squares, 0.8), sum, 1e-12 * sum) << loss_name(kind);
    EXPECT_EQ(loss.sum({}, 0.8), 0);
  }
}

TEST(Loss, RhoIsConcaveInTheSquareAndBelowIt) {
  for (const LossKind kind : kAll) {
    const Loss& loss = tuned_loss(kind, 3);
    EXPECT_EQ(loss.rho(0), 0);
    double last = loss.weight(1e-9);
    for (double s = 1e-6; s < 1e6; s *= 1.3) {
      EXPECT_GE(loss.rho(s), loss.weight(s) * s * (1 - 1e-12));
      EXPECT_LE(loss.weight(s), last);
      EXPECT_GE(loss.weight(s), 0);
      last = loss.weight(s);
      if (kind != LossKind::kDistance) {
        EXPECT_LE(loss.rho(s), s * (1 + 1e-12));
      }
    }
  }
  EXPECT_EQ(tuned_loss(LossKind::kTukey, 3).weight(1e4), 0);
  EXPECT_TRUE(std::isfinite(tuned_loss(LossKind::kDistance, 3).weight(0)));
}

/// A picture of a hundred corners that all are half as far off again is no outlier; one that is ten times as far is.
TEST(Loss, RowsOfVeryManyNumbersAreJudgedByTheirMeanSquare) {
  constexpr int kNumbers = 216;
  for (const LossKind kind : {LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey}) {
    const Loss &many = tuned_loss(kind, kNumbers), &few = tuned_loss(kind, kAsMany);
    for (const double square : {0.5, 1.0, 2.25, 100.0}) {  // of a number
      EXPECT_NEAR(many.weight(square * kNumbers), few.weight(square * kAsMany), 1e-15);
      EXPECT_NEAR(many.rho(square * kNumbers) / kNumbers, few.rho(square * kAsMany) / kAsMany, 1e-12);
    }
    // Squares of so many normal numbers add up to nearly what is expected.
    EXPECT_NEAR(many.expectation, many.rho(kNumbers), 0.01 * kNumbers);
    EXPECT_NEAR(many.consistency, many.weight(kNumbers), 0.01);
    const std::vector<double> squares{3, 250, 1e4};
    EXPECT_NEAR(many.sum(squares, 0.7), many.rho(2.1) + many.rho(175) + many.rho(7e3), 1e-9);
  }
}

TEST(Loss, NamesAreReadAndOthersRefused) {
  EXPECT_EQ(loss_kind("none"), LossKind::kNone);
  EXPECT_EQ(loss_kind("huber"), LossKind::kHuber);
  EXPECT_EQ(loss_kind("cauchy"), LossKind::kCauchy);
  EXPECT_EQ(loss_kind("tukey"), LossKind::kTukey);
  EXPECT_THROW(loss_kind("l2"), InvalidInput);
  EXPECT_THROW(tuned_loss(LossKind::kHuber, 0), InvalidInput);
  EXPECT_THROW(tuned_loss(LossKind::kHuber, kMostNumbers + 1), InvalidInput);
}

}  // namespace
}  // namespace fastcal
