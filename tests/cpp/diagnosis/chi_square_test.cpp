// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Closed forms of few degrees of freedom, and the density's own integral for many.
#include "fastcal/diagnosis/chi_square.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

double relative(double value, double expected) { return std::abs(value / expected - 1); }

TEST(ChiSquareTail, OneTwoThreeAndFourDegreesHaveClosedForms) {
  for (const double x : {1e-8, 0.01, 0.5, 1.0, 3.841458820694124, 20.0, 150.0, 700.0, 1350.0}) {
    const double h = x / 2;
    const double three = std::erfc(std::sqrt(h)) + std::sqrt(2 * x / std::numbers::pi) * std::exp(-h);
    EXPECT_LT(relative(chi_square_tail(x, 1), std::erfc(std::sqrt(h))), 1e-12) << x;
    EXPECT_LT(relative(chi_square_tail(x, 2), std::exp(-h)), 1e-12) << x;
    EXPECT_LT(relative(chi_square_tail(x, 3), three), 1e-12) << x;
    EXPECT_LT(relative(chi_square_tail(x, 4), std::exp(-h) * (1 + h)), 1e-12) << x;
  }
}

TEST(ChiSquareTail, OfManyDegreesIsTheIntegralOfTheDensity) {
  for (const int k : {5, 6, 17, 30}) {
    for (const double x : {0.3 * k, 1.0 * k, 4.0 * k}) {
      constexpr int kPieces = 200000;  // Simpson's rule over the tail, beyond which nothing counts
      const double step = (40.0 * k + 400 - x) / kPieces;
      const auto density = [k](double t) {
        return std::exp((0.5 * k - 1) * std::log(t) - t / 2 - 0.5 * k * std::log(2.0) - std::lgamma(0.5 * k));
      };
      double sum = density(x) + density(x + kPieces * step);
      for (int i = 1; i < kPieces; ++i) sum += (i % 2 == 1 ? 4 : 2) * density(x + i * step);
      EXPECT_LT(relative(chi_square_tail(x, k), sum * step / 3), 1e-9) << k << ", " << x;
    }
  }
}

TEST(ChiSquareTail, GoesDownToTheSmallestNumbersBeforeItIsZero) {
  const double x = 2 * 300 * std::numbers::ln10;  // exp(-x / 2) = 1e-300
  EXPECT_LT(relative(chi_square_tail(x, 2), 1e-300), 1e-11);
  EXPECT_LT(relative(chi_square_tail(x, 6), 1e-300 * (1 + x / 2 + x * x / 8)), 1e-11);
  // k = 5: the tail is that of k = 3 and one term more, 2 (x / 2)^(3/2) exp(-x / 2) / (3 Gamma(3/2)).
  const double term = std::exp(-x / 2 + 1.5 * std::log(x / 2) - std::lgamma(2.5));
  EXPECT_LT(relative(chi_square_tail(x, 5) - chi_square_tail(x, 3), term), 1e-10);
  EXPECT_EQ(chi_square_tail(1e5, 3), 0);
}

TEST(ChiSquareTail, FallsWithXRisesWithKAndStartsAtOne) {
  for (int k = 1; k <= 12; ++k) {
    EXPECT_NEAR(chi_square_tail(0, k), 1, 1e-15);
    EXPECT_GT(chi_square_tail(2.0, k), chi_square_tail(2.5, k));
    EXPECT_GT(chi_square_tail(2.0, k + 1), chi_square_tail(2.0, k));
  }
}

TEST(ChiSquareTail, RefusesWhatHasNoTail) {
  EXPECT_THROW(chi_square_tail(1.0, 0), InvalidInput);
  EXPECT_THROW(chi_square_tail(-1e-12, 3), InvalidInput);
  EXPECT_THROW(chi_square_tail(std::nan(""), 3), InvalidInput);
}

}  // namespace
}  // namespace fastcal
