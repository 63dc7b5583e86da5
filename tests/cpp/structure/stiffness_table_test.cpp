// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/stiffness_table.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <functional>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Samples on a grid of angles -1.5 .. 1.5 rad and extensions 0.2 .. 0.9 m.
StiffnessSamples sample(const std::function<Matrix3(double, double)>& K, int angles = 7, int extensions = 6) {
  StiffnessSamples samples;
  const int count = angles * extensions;
  samples.angle.resize(count);
  samples.extension.resize(count);
  samples.matrices.resize(count, 9);
  for (int i = 0; i < count; ++i) {
    samples.angle[i] = -1.5 + 3.0 * (i % angles) / (angles - 1);
    samples.extension[i] = 0.2 + 0.7 * (i / angles) / (extensions - 1);
    const Matrix3 matrix = K(samples.angle[i], samples.extension[i]);
    samples.matrices.row(i) = Eigen::Map<const Eigen::RowVectorXd>(matrix.data(), 9);
  }
  return samples;
}

/// Every entry a cubic in d times a quadratic in theta.
Matrix3 product(double theta, double d) {
  const double g = 1 + 0.2 * theta - 0.1 * theta * theta;
  const double f = 5 - 3 * d + d * d - 0.4 * d * d * d;
  Matrix3 K;
  K << 1e8 * (2 - d), 0, 0,                //
      0, 1e6 * f * g, -4e5 * (2 - d) * g,  //
      0, -4e5 * (2 - d) * g, 3e5 * (3 - d * d) * (2 + theta / 3);
  return K;
}

TEST(StiffnessTable, ProductsOfPolynomialsAreFoundExactly) {
  const StiffnessTable table(sample(product), 2, 3);
  EXPECT_LT(table.relative_error(), 1e-12);
  Eigen::VectorXd angle(2), extension(2);
  angle << 0.37, -1.23;
  extension << 0.44, 0.81;
  const RowMatrixXd K = table.evaluate(angle, extension);
  for (int i = 0; i < 2; ++i) {
    const Matrix3 expected = product(angle[i], extension[i]);
    EXPECT_LT((Eigen::Map<const Matrix3>(K.row(i).data()) - expected).cwiseAbs().maxCoeff(), 1e-12 * expected(0, 0));
    EXPECT_NEAR(K(i, 4), expected(1, 1), 1e-11 * expected(1, 1));
  }
}

/// A telescope of length 0.6 m + d with a section that turns with theta: bending is 1/L^3 times cos^2 and sin^2 of
/// theta, a product but no polynomial, so the error falls with the degree.
Matrix3 telescope(double theta, double d) {
  const double L = 0.6 + d, EI = 1e5 * (1 + 0.5 * std::cos(2 * theta));
  Matrix3 K;
  K << 4e8 / L, 0, 0, 0, 12 * EI / (L * L * L), -6 * EI / (L * L), 0, -6 * EI / (L * L), 4 * EI / L;
  return K;
}

TEST(StiffnessTable, HigherDegreesFitATelescopeBetter) {
  const StiffnessTable coarse(sample(telescope), 4, 3), fine(sample(telescope, 11, 9), 8, 6);
  EXPECT_LT(coarse.relative_error(), 5e-2);
  EXPECT_LT(fine.relative_error(), 1e-3);
}

/// (a + b d)(1 + c theta): for every c of a fine grid, a and b by least squares; none leaves less than the table.
TEST(StiffnessTable, NoOtherProductFitsBetter) {
  const StiffnessSamples samples = sample([](double theta, double d) {
    Matrix3 K = telescope(theta, d);
    K(1, 1) *= 2 + 0.2 * theta + 0.3 * theta * d;
    return K;
  });
  const Eigen::VectorXd k = samples.matrices.col(4);
  const double left = (StiffnessTable(samples, 1, 1).evaluate(samples.angle, samples.extension).col(4) - k).norm();
  EXPECT_GT(left, 0.05 * k.norm());
  for (double c = -2; c < 2; c += 1e-3) {
    Eigen::MatrixXd basis(k.size(), 2);
    basis.col(0) = (1 + c * samples.angle.array()).matrix();
    basis.col(1) = basis.col(0).cwiseProduct(samples.extension);
    const Eigen::VectorXd ab = basis.colPivHouseholderQr().solve(k);
    EXPECT_GE((basis * ab - k).norm(), left * (1 - 1e-9)) << c;
  }
}

TEST(StiffnessTable, WhatCantBeFittedIsRefused) {
  const StiffnessSamples good = sample(product);
  EXPECT_THROW(StiffnessTable(good, 7, 3), InvalidInput);  // 7 angles carry degree 6
  EXPECT_THROW(StiffnessTable(good, 2, 6), InvalidInput);
  StiffnessSamples skew = good;
  skew.matrices(3, 5) *= 1.01;
  EXPECT_THROW(StiffnessTable(skew, 2, 3), InvalidInput);
  StiffnessSamples negative = good;
  negative.matrices(3, 0) = -1;
  EXPECT_THROW(StiffnessTable(negative, 2, 3), InvalidInput);
  const StiffnessTable table(good, 2, 3);
  EXPECT_THROW(table.evaluate(Eigen::VectorXd::Constant(1, 1.7), Eigen::VectorXd::Constant(1, 0.5)), InvalidInput);
  EXPECT_THROW(table.evaluate(Eigen::VectorXd::Constant(1, NAN), Eigen::VectorXd::Constant(1, 0.5)), InvalidInput);
}

}  // namespace
}  // namespace fastcal
