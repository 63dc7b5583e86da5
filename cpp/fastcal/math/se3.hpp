// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// SO(3) and SE(3): exponential, logarithm, adjoint and their derivatives. Twists are [v; w], body frame.
// Source: J. Solà, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), appendices B
// and D.
#pragma once

#include "fastcal/math/types.hpp"

namespace fastcal {

/// [w]x, so that skew(w) * p = w x p.
Eigen::Matrix3d skew(const Eigen::Vector3d& w);

/// exp([w]x) by Rodrigues (Solà 132); exact for every |w|.
Eigen::Matrix3d exp_so3(const Eigen::Vector3d& w);

/// The rotation vector of R, |w| in [0, pi] (Solà 133); exact near 0 and near pi.
Eigen::Vector3d log_so3(const Eigen::Matrix3d& R);

/// J_r with exp(w + dw) = exp(w) exp(J_r dw) to first order (Solà 143).
Eigen::Matrix3d right_jacobian_so3(const Eigen::Vector3d& w);

/// Inverse of right_jacobian_so3 (Solà 144); |w| < 2 pi.
Eigen::Matrix3d right_jacobian_inverse_so3(const Eigen::Vector3d& w);

/// exp of the twist xi = [v; w] (Solà 172).
Pose exp_se3(const Vector6d& xi);

/// The twist xi = [v; w] with exp_se3(xi) = T (Solà 173).
Vector6d log_se3(const Pose& T);

/// J_r (6 x 6) with exp(xi + d) = exp(xi) exp(J_r d) to first order (Solà 179, in the order [v; w]).
Matrix6d right_jacobian_se3(const Vector6d& xi);

/// Ad_T: the twist xi_b of frame b, seen in frame a: xi_a = Ad(T_a_b) xi_b (Solà 175).
Matrix6d adjoint(const Pose& T_a_b);

/// Fixed-axis XYZ angles (roll, pitch, yaw) to R = Rz(yaw) Ry(pitch) Rx(roll), as URDF.
Eigen::Matrix3d rpy_to_rotation(const Eigen::Vector3d& rpy);

/// Roll, pitch, yaw of R; at pitch = +-90 degrees, where only their sum is defined, roll is 0.
Eigen::Vector3d rotation_to_rpy(const Eigen::Matrix3d& R);

/// Rotation of a unit quaternion (w, x, y, z).
Eigen::Matrix3d quaternion_to_rotation(const Eigen::Vector4d& wxyz);

}  // namespace fastcal
