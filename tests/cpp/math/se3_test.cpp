// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/se3.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "support/random.hpp"

namespace fastcal {
namespace {

using test::kPi;
using test::Random;

Eigen::Matrix4d matrix(const Pose& T) {
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.topLeftCorner<3, 3>() = T.R;
  M.topRightCorner<3, 1>() = T.p;
  return M;
}

/// exp of any matrix by its power series, in long double after halving it until it is small: no closed form of SE(3).
Eigen::Matrix4d series_exp(const Vector6d& xi) {
  using Matrix = Eigen::Matrix<long double, 4, 4>;
  Matrix A = Matrix::Zero();
  A.topLeftCorner<3, 3>() = skew(xi.tail<3>()).cast<long double>();
  A.topRightCorner<3, 1>() = xi.head<3>().cast<long double>();
  constexpr int kHalvings = 8;
  A /= 1 << kHalvings;
  Matrix sum = Matrix::Identity();
  Matrix term = Matrix::Identity();
  for (int k = 1; k < 25; ++k) {
    term = term * A / k;
    sum += term;
  }
  for (int i = 0; i < kHalvings; ++i) sum = sum * sum;
  return sum.cast<double>();
}

/// Angles around every place where a formula changes or breaks.
const std::vector<double> kAngles{0,    1e-300,     1e-160,     1e-12,      1e-9,        1e-8, 1e-5,
                                  1e-3, 0.0499999,  0.0500001,  0.499999,   0.500001,    1,    2,
                                  3,    kPi - 1e-3, kPi - 1e-6, kPi - 1e-9, kPi - 1e-12, kPi};

TEST(Se3, ExpIsThePowerSeries) {
  Random random(1);
  for (const double angle : kAngles) {
    for (int k = 0; k < 20; ++k) {
      Vector6d xi;
      xi << random.vector(2), angle * random.unit();
      EXPECT_LT((matrix(exp_se3(xi)) - series_exp(xi)).cwiseAbs().maxCoeff(), 2e-15) << "angle " << angle;
      EXPECT_EQ(exp_so3(xi.tail<3>()), exp_se3(xi).R);
    }
  }
}

TEST(Se3, LogIsTheInverseOfExpAtEveryAngle) {
  Random random(2);
  for (const double angle : kAngles) {
    for (int k = 0; k < 20; ++k) {
      Vector6d xi;
      xi << random.vector(2), angle * random.unit();
      const Vector6d back = log_se3(exp_se3(xi));
      const double tolerance = 4e-15;
      EXPECT_LT((matrix(exp_se3(back)) - matrix(exp_se3(xi))).cwiseAbs().maxCoeff(), tolerance) << "angle " << angle;
      if (angle > kPi - 1e-8) continue;  // there both w and -w are the same rotation to rounding
      EXPECT_LT((back - xi).cwiseAbs().maxCoeff(), tolerance) << "angle " << angle;
    }
  }
}

TEST(Se3, LogKeepsTinyTurnsToTheLastDigit) {
  const Eigen::Vector3d w(1e-9, -2e-9, 3e-9);
  EXPECT_LT((log_so3(exp_so3(w)) - w).norm(), 1e-24);
}

TEST(Se3, LogOfAHalfTurnIsPiAboutItsAxis) {
  Random random(3);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d axis = k < 3 ? Eigen::Vector3d(Eigen::Vector3d::Unit(k)) : random.unit();
    const Eigen::Vector3d w = log_so3(2 * axis * axis.transpose() - Eigen::Matrix3d::Identity());
    EXPECT_NEAR(w.norm(), kPi, 1e-14);
    EXPECT_NEAR(std::abs(w.dot(axis)), kPi, 1e-13);
  }
}

/// d of f(x + d) at 0 by a stencil of five points: error ~ 1e-12.
template <typename F>
auto derivative(const F& f) {
  constexpr double h = 1e-3;
  return ((8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)).eval();
}

TEST(Se3, RightJacobiansAreTheDerivativeOfExp) {
  Random random(4);
  for (const double angle : kAngles) {
    Vector6d xi;
    xi << random.vector(2), angle * random.unit();
    const Matrix6d J = right_jacobian_se3(xi);
    for (int k = 0; k < 6; ++k) {
      const auto column =
          derivative([&](double h) { return log_se3(exp_se3(xi).inverse() * exp_se3(xi + h * Vector6d::Unit(k))); });
      EXPECT_LT((J.col(k) - column).cwiseAbs().maxCoeff(), 1e-11) << "angle " << angle << ", column " << k;
    }
    const Eigen::Vector3d w = xi.tail<3>();
    EXPECT_LT((right_jacobian_so3(w) - J.bottomRightCorner<3, 3>()).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_LT(
        (right_jacobian_inverse_so3(w) * right_jacobian_so3(w) - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(),
        1e-14);
  }
}

// The formulas switch from a series to a closed form: on both sides of the switch they must agree far better than the
// derivative test can see.
TEST(Se3, JacobiansDoNotJumpWhereTheirFormulasChange) {
  Random random(5);
  for (const double border : {0.05, 0.5}) {
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d axis = random.unit();
      Vector6d below;
      Vector6d above;
      const Eigen::Vector3d v = random.vector(1);
      below << v, border * (1 - 1e-15) * axis;
      above << v, border * (1 + 1e-15) * axis;
      EXPECT_LT((right_jacobian_se3(below) - right_jacobian_se3(above)).cwiseAbs().maxCoeff(), 5e-15);
      EXPECT_LT((right_jacobian_inverse_so3(below.tail<3>()) - right_jacobian_inverse_so3(above.tail<3>()))
                    .cwiseAbs()
                    .maxCoeff(),
                5e-15);
    }
  }
}

TEST(Se3, AdjointMovesATwistToAnotherFrame) {
  Random random(6);
  for (int k = 0; k < 100; ++k) {
    const Pose T = random.pose(2);
    Vector6d xi;
    xi << random.vector(1), random.vector(1);
    const Pose left = exp_se3(adjoint(T) * xi) * T;
    EXPECT_LT((matrix(left) - matrix(T * exp_se3(xi))).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(Se3, RollPitchYawTurnAboutFixedAxesInTheOrderXYZ) {
  const double r = 0.3;
  const double p = -0.7;
  const double y = 2.1;
  Eigen::Matrix3d X;
  Eigen::Matrix3d Y;
  Eigen::Matrix3d Z;
  X << 1, 0, 0, 0, std::cos(r), -std::sin(r), 0, std::sin(r), std::cos(r);
  Y << std::cos(p), 0, std::sin(p), 0, 1, 0, -std::sin(p), 0, std::cos(p);
  Z << std::cos(y), -std::sin(y), 0, std::sin(y), std::cos(y), 0, 0, 0, 1;
  EXPECT_LT((rpy_to_rotation({r, p, y}) - Z * Y * X).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(Se3, RollPitchYawComeBackAlsoNextToTheVertical) {
  Random random(7);
  for (const double from_vertical : {1.0, 1e-2, 1e-6, 1e-7, 1e-8, 1e-10, 1e-13, 1e-15, 0.0}) {
    for (const double sign : {-1.0, 1.0}) {
      for (int k = 0; k < 50; ++k) {
        const Eigen::Vector3d rpy(random.uniform(-kPi, kPi), sign * (kPi / 2 - from_vertical),
                                  random.uniform(-kPi, kPi));
        const Eigen::Matrix3d R = rpy_to_rotation(rpy);
        const Eigen::Vector3d back = rotation_to_rpy(R);
        EXPECT_LT((rpy_to_rotation(back) - R).cwiseAbs().maxCoeff(), 5e-15)
            << "pitch " << rpy.y() << " roll " << rpy.x() << " yaw " << rpy.z();
        EXPECT_LE(std::abs(back.y()), kPi / 2);
        if (from_vertical == 1) {
          EXPECT_LT((back - rpy).norm(), 1e-14);
        }
      }
    }
  }
  EXPECT_EQ(rotation_to_rpy(rpy_to_rotation({0.4, kPi / 2, 0.1})).x(), 0);
}

TEST(Se3, QuaternionsAreWxyzAndBroughtToLengthOne) {
  const Eigen::Vector3d w(0.2, -0.5, 0.9);
  const double half = w.norm() / 2;
  const Eigen::Vector3d v = std::sin(half) * w.normalized();
  const Eigen::Vector4d q(std::cos(half), v.x(), v.y(), v.z());
  EXPECT_LT((quaternion_to_rotation(q) - exp_so3(w)).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((quaternion_to_rotation(-3 * q) - exp_so3(w)).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(Se3, PosesMultiplyAndInvertLikeMatrices) {
  Random random(8);
  const Pose a = random.pose(3);
  const Pose b = random.pose(3);
  const Eigen::Vector3d p = random.vector(1);
  EXPECT_LT((matrix(a * b) - matrix(a) * matrix(b)).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((matrix(a.inverse()) - matrix(a).inverse()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT(((a * p) - (matrix(a) * p.homogeneous()).head<3>()).norm(), 1e-14);
}

}  // namespace
}  // namespace fastcal
