// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The mass matrix of the links: kinetic energy = 1/2 qd^T M qd,
//   M = sum_b m_b Jv_b^T Jv_b + Jw_b^T I_b Jw_b,   Jv, Jw the motion of body b's centre of mass by the joints before
//   it.
#pragma once

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// (N, n, n), C order, at joint positions q (N, n), of the nominal chain.
void mass_matrices(const RobotModel& robot, const Eigen::Ref<const RowMatrixXd>& q, double* M);

}  // namespace fastcal
