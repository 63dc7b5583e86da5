// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What an arm of this size may be expected to yield: plausible sizes of what follows loads. A compliance is small or
// large beside the weight that it carries, not in rad/(N m): a joint of a cobot gives a hundred times more for a torque
// than one of a 500 kg arm, and both sag by about as much.
#pragma once

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

constexpr double kSag = 0.02;          ///< [rad] by which one joint may give under the whole arm, stretched out
constexpr double kMassDensity = 40.0;  ///< [kg/m^3] arms of 20 to 2000 kg weigh 13 to 110 times their reach cubed

/// Length [m] of all links, stretched out; 1 where none has a length.
inline double arm_reach(const RobotModel& robot) {
  double sum = 0;
  for (int i = 0; i < robot.joint_count(); ++i) sum += robot.link_axis(i).norm();
  return sum > 0 ? sum : 1.0;
}

/// Mass [kg] of the whole arm; where the file gives none, that of a usual arm of this reach.
inline double arm_mass(const RobotModel& robot) {
  double sum = 0;
  for (const Body& body : robot.description().bodies) sum += body.mass;
  return sum > 0 ? sum : kMassDensity * arm_reach(robot) * arm_reach(robot) * arm_reach(robot);
}

/// Plausible compliance of a joint [rad/(N m)]; of a slider [m/N], whose carriage tilts as much.
inline double plausible_compliance(const RobotModel& robot, JointType type = JointType::kRevolute) {
  constexpr double kGravity = 9.80665;
  const double reach = arm_reach(robot);
  const double turn = kSag / (arm_mass(robot) * kGravity * reach);
  return type == JointType::kRevolute ? turn : turn * reach * reach;
}

/// Plausible 1 / EI of a link [1/(N m^2)]: as long as the arm, it turns its end as far as a joint may turn.
inline double plausible_bending(const RobotModel& robot) { return plausible_compliance(robot) / arm_reach(robot); }

}  // namespace fastcal
