// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/se3.hpp"

#include <cmath>

namespace fastcal {
namespace {

// The four series that SO(3) and SE(3) need, as functions of t = |w|, by Taylor below kSmall (error < 1e-16 there):
// a = sin t / t, b = (1 - cos t) / t^2, c = (t - sin t) / t^3, d = (t^2 + 2 cos t - 2) / (2 t^4), e = (2 t - 3 sin t +
// t cos t) / (2 t^5).
constexpr double kSmall = 0.05;

double series_a(double t) {
  if (t > kSmall) return std::sin(t) / t;
  const double t2 = t * t;
  return 1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72)));
}

double series_b(double t) {
  if (t > kSmall) {
    const double s = std::sin(t / 2) / t;
    return 2 * s * s;
  }
  const double t2 = t * t;
  return 0.5 * (1 - t2 / 12 * (1 - t2 / 30 * (1 - t2 / 56 * (1 - t2 / 90))));
}

double series_c(double t) {
  if (t > kSmall) return (t - std::sin(t)) / (t * t * t);
  const double t2 = t * t;
  return (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110)))) / 6;
}

// d and e lose 4 and 5 powers of t to cancellation, so their series reach further.
constexpr double kSmallHighOrder = 0.5;

double series_d(double t) {
  const double t2 = t * t;
  if (t > kSmallHighOrder) return (t2 + 2 * std::cos(t) - 2) / (2 * t2 * t2);
  return (1 - t2 / 30 * (1 - t2 / 56 * (1 - t2 / 90 * (1 - t2 / 132 * (1 - t2 / 182 * (1 - t2 / 240)))))) / 24;
}

double series_e(double t) {
  const double t2 = t * t;
  if (t > kSmallHighOrder) return (2 * t - 3 * std::sin(t) + t * std::cos(t)) / (2 * t2 * t2 * t);
  double sum = 0;  // sum_k (-1)^k (k + 1) / (2 k + 5)! t^2k
  double term = 1.0 / 120;
  for (int k = 0; k < 10; ++k) {
    sum += (k + 1) * term;
    term *= -t2 / ((2 * k + 6) * (2 * k + 7));
  }
  return sum;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d S;
  S << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return S;
}

Eigen::Matrix3d exp_so3(const Eigen::Vector3d& w) {
  const double t = w.norm();
  const Eigen::Matrix3d W = skew(w);
  return Eigen::Matrix3d::Identity() + series_a(t) * W + series_b(t) * W * W;
}

Eigen::Vector3d log_so3(const Eigen::Matrix3d& R) {
  // By the quaternion, whose largest part never vanishes: no loss near 0 or near pi.
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  if (s < 1e-9) return 2 * q.vec();  // 2 atan2(s, w) / s = 2 + O(s^2)
  return 2 * std::atan2(s, q.w()) / s * q.vec();
}

Eigen::Matrix3d right_jacobian_so3(const Eigen::Vector3d& w) {
  const double t = w.norm();
  const Eigen::Matrix3d W = skew(w);
  return Eigen::Matrix3d::Identity() - series_b(t) * W + series_c(t) * W * W;
}

Eigen::Matrix3d right_jacobian_inverse_so3(const Eigen::Vector3d& w) {
  const double t = w.norm();
  const Eigen::Matrix3d W = skew(w);
  // 1/t^2 - (1 + cos t) / (2 t sin t) = (1 - a / (2 b)) / t^2
  const double k =
      t > kSmall ? (1 - series_a(t) / (2 * series_b(t))) / (t * t) : (1 + t * t / 60 * (1 + t * t / 42)) / 12;
  return Eigen::Matrix3d::Identity() + 0.5 * W + k * W * W;
}

Pose exp_se3(const Vector6d& xi) {
  const Eigen::Vector3d w = xi.tail<3>();
  return {exp_so3(w), right_jacobian_so3(-w) * xi.head<3>()};
}

Vector6d log_se3(const Pose& T) {
  const Eigen::Vector3d w = log_so3(T.R);
  Vector6d xi;
  xi << right_jacobian_inverse_so3(-w) * T.p, w;
  return xi;
}

Matrix6d right_jacobian_se3(const Vector6d& xi) {
  const Eigen::Vector3d w = -xi.tail<3>();  // J_r(xi) = J_l(-xi)
  const Eigen::Vector3d v = -xi.head<3>();
  const double t = w.norm();
  const Eigen::Matrix3d W = skew(w);
  const Eigen::Matrix3d V = skew(v);
  const Eigen::Matrix3d Q = 0.5 * V + series_c(t) * (W * V + V * W + W * V * W) +
                            series_d(t) * (W * W * V + V * W * W - 3 * W * V * W) +
                            series_e(t) * (W * V * W * W + W * W * V * W);
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = right_jacobian_so3(-w);
  J.topRightCorner<3, 3>() = Q;
  return J;
}

Matrix6d adjoint(const Pose& T_a_b) {
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = T_a_b.R;
  A.topRightCorner<3, 3>() = skew(T_a_b.p) * T_a_b.R;
  return A;
}

Eigen::Matrix3d rpy_to_rotation(const Eigen::Vector3d& rpy) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return (AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d rotation_to_rpy(const Eigen::Matrix3d& R) {
  const double c = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), c);
  if (c < 1e-14) return {0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  // Roll from what Rz(-yaw) leaves: as exact near the singular pitch as far from it (rows of R alone lose digits
  // there).
  const double s = std::sin(yaw);
  const double k = std::cos(yaw);
  return {std::atan2(s * R(0, 2) - k * R(1, 2), k * R(1, 1) - s * R(0, 1)), pitch, yaw};
}

Eigen::Matrix3d quaternion_to_rotation(const Eigen::Vector4d& wxyz) {
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
}

}  // namespace fastcal
