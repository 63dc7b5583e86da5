// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The smoothest curves without ends to hold them are the modes of a free beam: w = (beta / length)^4 with cos(beta)
// cosh(beta) = 1.
#include "fastcal/math/smooth_curves.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace fastcal {
namespace {

/// Mean of f over [low, high] by Simpson's rule on many pieces.
template <typename F>
Eigen::MatrixXd mean(double low, double high, const F& f) {
  constexpr int kPieces = 4000;
  Eigen::MatrixXd sum = f(low) + f(high);
  for (int i = 1; i < kPieces; ++i) sum += (i % 2 == 1 ? 4 : 2) * f(low + (high - low) * i / kPieces);
  return sum / (3.0 * kPieces);
}

TEST(SmoothCurves, AreOfUnitSizeAndApartFromEachOtherAndFromTheConstant) {
  for (const bool periodic : {false, true}) {
    const SmoothCurves curves(-0.4, 2.1, 9, periodic);
    ASSERT_EQ(curves.count(), periodic ? 8 : 11);
    const auto products = [&](double x) {
      const Eigen::VectorXd v = curves.values(x);
      Eigen::MatrixXd out(v.size(), v.size() + 1);
      out << v * v.transpose(), v;
      return out;
    };
    const Eigen::MatrixXd all = mean(-0.4, 2.1, products);
    EXPECT_LT((all.leftCols(curves.count()) - Eigen::MatrixXd::Identity(curves.count(), curves.count()))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9);
    EXPECT_LT(all.rightCols(1).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(SmoothCurves, RoughnessIsTheMeanSquareOfTheCurvature) {
  const SmoothCurves curves(-0.4, 2.1, 9, false);
  constexpr double kStep = 1e-4;
  const auto bends = [&](double x) {
    const double at = std::min(std::max(x, -0.4 + kStep), 2.1 - kStep);
    const Eigen::VectorXd bend = (curves.slopes(at + kStep) - curves.slopes(at - kStep)) / (2 * kStep);
    return Eigen::MatrixXd(bend * bend.transpose());
  };
  const Eigen::MatrixXd got = mean(-0.4, 2.1, bends);
  for (int k = 0; k < curves.count(); ++k)
    EXPECT_NEAR(got(k, k), curves.roughness()[k], 1e-3 * (1 + curves.roughness()[k])) << k;
}

TEST(SmoothCurves, OfAnIntervalAreTheModesOfAFreeBeam) {
  const double length = 1.7;
  const SmoothCurves curves(0.3, 0.3 + length, 60, false);
  EXPECT_EQ(curves.roughness()[0], 0);  // the straight line
  const double beta[4] = {4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464};
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(curves.roughness()[k + 1] / std::pow(beta[k] / length, 4), 1, 1e-5) << k;
}

TEST(SmoothCurves, OfACircleAreItsWaves) {
  const SmoothCurves curves(-std::numbers::pi, std::numbers::pi, 60, true);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(curves.roughness()[k] / std::pow(k / 2 + 1, 4), 1, 1e-3) << k;
  EXPECT_LT((curves.values(-std::numbers::pi) - curves.values(std::numbers::pi)).norm(), 1e-12);
}

TEST(SmoothCurves, SlopesAreTheDerivative) {
  const SmoothCurves curves(0, 1, 7, false);
  constexpr double kStep = 1e-6;
  for (const double x : {0.1, 0.33, 0.71}) {
    const Eigen::VectorXd expected = (curves.values(x + kStep) - curves.values(x - kStep)) / (2 * kStep);
    EXPECT_LT((curves.slopes(x) - expected).norm(), 1e-6 * (1 + expected.norm()));
  }
}

}  // namespace
}  // namespace fastcal
