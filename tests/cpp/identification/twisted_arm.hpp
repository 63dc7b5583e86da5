// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An upper arm that its load twists, between two axes that are parallel but for a milliradian: opposite offsets d of
// the two move the tool by what the twist and that angle make of them, and change the twist's own load by as much.
#pragma once

#include "fastcal/effects/registry.hpp"
#include "support/simulation.hpp"

namespace fastcal::test {

inline ErrorModel twisted_arm() {
  RobotDescription description;
  const Tables tables = six_axes(1e-3);
  description.joint_types = tables.types;
  description.T_flange_tool = tables.tool;
  description.bodies.resize(6);
  description.bodies[2].mass = 300;
  description.bodies[2].com = {0, -0.1, 0.3};
  const RobotModel robot = build_dh(description, tables.rows);
  return ErrorModel(robot, {make_effect("link_torsion", robot, "link2", {})}, Eigen::VectorXd::Constant(1, 1e-6));
}

}  // namespace fastcal::test
