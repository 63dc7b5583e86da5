// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The few matrix types that cross folder borders. Samples come first: (N, n), C order, float64.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace fastcal {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using RowMatrixXi = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A rigid motion as its two parts, T = [R p; 0 1].
struct Pose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  Pose operator*(const Pose& other) const { return {R * other.R, R * other.p + p}; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return R * point + p; }
  Pose inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
};

}  // namespace fastcal
