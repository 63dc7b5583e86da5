// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// DH tables whose flange is not the frame that the last row ends in: a controller's flange may be turned against it.
#pragma once

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// As the builders without it, with link_n at the pose `flange` in the frame of the last row. Bodies and the last
/// link's beam stay those of the row.
RobotModel build_dh(RobotDescription description, const RowMatrixXd& rows, const Pose& flange);
RobotModel build_mdh(RobotDescription description, const RowMatrixXd& rows, const Pose& flange);

}  // namespace fastcal
