// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Scales of noise on draws of their own: normal numbers, one, two or three a row, with and without what rows claim.
#include "fastcal/identification/noise_scale.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>
#include <vector>

namespace fastcal {
namespace {

constexpr double kNoise = 4e-5;
constexpr double kFloor = 1e-10;

ObservedRows drawn(int components, int rows, double claimed, int gross = 0) {
  std::mt19937 random(static_cast<unsigned>(components));
  std::normal_distribution<double> normal(0, std::hypot(kNoise, claimed));
  ObservedRows out;
  for (int i = 0; i < rows; ++i) {
    static std::deque<std::vector<double>> kept;  // what rows refer to
    std::vector<double>& squares = kept.emplace_back();
    std::vector<double>& variances = kept.emplace_back(components, claimed * claimed);
    for (int c = 0; c < components; ++c) {
      const double r = normal(random) + (i < gross ? 0.1 : 0);
      squares.push_back(r * r);
    }
    const ObservedRow row{squares, variances, components};
    if (claimed > 0) {
      out.add(row);
    } else {
      out.add(components, row.whitened(1));
    }
  }
  return out;
}

TEST(NoiseScale, TheMedianIsThatOfChiSquaredForAnyNumberOfComponents) {
  for (const int components : {1, 2, 3}) {
    EXPECT_NEAR(median_noise(drawn(components, 20000, 0), kFloor, kNoise), kNoise, 0.03 * kNoise) << components;
    EXPECT_NEAR(median_noise(drawn(components, 20000, 5e-5), kFloor, 1e-3), kNoise, 0.06 * kNoise) << components;
  }
}

TEST(NoiseScale, TheMedianBearsGrossRowsAndTheMeanCountsDegreesOfFreedom) {
  EXPECT_LT(median_noise(drawn(3, 20000, 0, 6000), kFloor, kNoise), 1.5 * kNoise);
  const double all = mean_noise(drawn(3, 20000, 0), LossKind::kNone, 1, kFloor, kNoise);
  EXPECT_NEAR(all, kNoise, 0.01 * kNoise);
  const double left = mean_noise(drawn(3, 20000, 0), LossKind::kNone, 0.64, kFloor, kNoise);
  EXPECT_NEAR(left / all, 1 / 0.8, 1e-6);
}

TEST(NoiseScale, TheMedianOfVeryManyRowsIsThatOfTheSortedOnes) {
  std::mt19937 random(7);
  std::chi_squared_distribution<double> squares(3);
  for (const std::size_t rows : {std::size_t{100'000}, std::size_t{150'001}}) {
    std::vector<double> drawn(rows);
    for (double& square : drawn) square = kNoise * kNoise * squares(random);
    drawn[5] = 0;
    const double found = median_noise({3, drawn}, kFloor, kNoise);
    std::sort(drawn.begin(), drawn.end());
    const double cube = 1 - 2 / 27.0;
    EXPECT_EQ(found, std::sqrt(drawn[rows / 2] / (3 * cube * cube * cube)));
  }
}

// A claim that is nothing beside the noise makes no difference.
TEST(NoiseScale, RowsThatClaimHardlyAnythingCountAsThoseThatClaimNothing) {
  for (const int components : {1, 2, 3}) {
    const ObservedRows plain = drawn(components, 500, 0, 20);
    const ObservedRows claiming = drawn(components, 500, 1e-14, 20);
    ASSERT_EQ(claiming.claiming().size(), 500U);
    EXPECT_NEAR(median_noise(plain, kFloor, kNoise) / median_noise(claiming, kFloor, kNoise), 1, 1e-9);
    for (const LossKind loss : {LossKind::kNone, LossKind::kTukey}) {
      const double noise = mean_noise(plain, loss, 0.9, kFloor, kNoise);
      EXPECT_NEAR(noise / mean_noise(claiming, loss, 0.9, kFloor, kNoise), 1, 1e-9) << loss_name(loss);
    }
  }
}

TEST(NoiseScale, OutlierLimitsAreThoseOfTablesOfChiSquared) {
  // P(chi^2 > x) = 1e-2 / N for N = 1 and 100: 6.635 and 15.137 with one degree of freedom, 9.210 and 18.421 with two,
  // 11.345 and 21.108 with three.
  const double table[3][2] = {{6.635, 15.137}, {9.210, 18.421}, {11.345, 21.108}};
  for (int d = 1; d <= 3; ++d) {
    EXPECT_NEAR(outlier_limit(d, 1), table[d - 1][0], 1e-3);
    EXPECT_NEAR(outlier_limit(d, 100), table[d - 1][1], 1e-3);
  }
  // scipy.stats.chi2.isf(0.01 / N, d) for N = 50 and a million.
  EXPECT_NEAR(outlier_limit(3, 50), 19.656115720297333, 1e-11);
  EXPECT_NEAR(outlier_limit(3, 1e6), 40.12999901768822, 1e-11);
  EXPECT_NEAR(outlier_limit(12, 50), 37.29607541480976, 1e-11);
  EXPECT_NEAR(outlier_limit(12, 1e6), 61.93423194661251, 1e-11);
}

TEST(NoiseScale, TheVarianceUnderHubersLossIsThatOfHisBook) {
  // P. Huber 1981, (7.10) and (6.13): K^2 (sum psi^2 / n) / m^2 with K = 1 + (p / n) (1 - m) / m, m the share of the
  // residuals within c = 1.345. Ten of one number each, eight within; half of the degrees of freedom are left.
  constexpr double kFreedom = 0.5;
  constexpr double kTuning = 1.345;
  const double squares[10] = {0.04, 0.25, 0.49, 1.0, 0.09, 0.36, 0.64, 0.81, 9.0, 16.0};
  VarianceInflation inflation(LossKind::kHuber, kFreedom);
  double within = 0;
  for (const double square : squares) {
    inflation.add({square * kFreedom, 1, 1});
    if (square <= kTuning * kTuning) within += square;
  }
  const double K = 1 + 0.5 * 0.2 / 0.8;
  const double expected = K * K * (within + 2 * kTuning * kTuning) / 10 / (0.8 * 0.8);
  EXPECT_NEAR(inflation.value(), expected, 1e-4 * expected);
}

}  // namespace
}  // namespace fastcal
