// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Robots for tests: random tables of all four kinds, and arms whose geometry is known.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fastcal/robot/robot_model.hpp"
#include "support/random.hpp"

namespace fastcal::test {

inline constexpr std::array<const char*, 4> kKinds4{"dh", "mdh", "poe", "urdf"};

/// Geometry of one robot in the numbers of a robot file (SI).
struct Tables {
  std::vector<JointType> types;
  RowMatrixXd rows;    ///< (n, 5) theta d a alpha beta
  RowMatrixXd screws;  ///< (n, 7) omega v offset
  std::vector<Eigen::Vector3d> origin_xyz, origin_rpy;
  RowMatrixXd axes;  ///< (n, 3)
  Pose end;          ///< home (poe) or flange (urdf)
  Pose base, tool;

  int joint_count() const { return static_cast<int>(types.size()); }
};

inline Tables random_tables(Random& random, int joints) {
  Tables t;
  t.rows.resize(joints, 5);
  t.screws.resize(joints, 7);
  t.axes.resize(joints, 3);
  for (int i = 0; i < joints; ++i) {
    const bool revolute = random.chance(0.7);
    t.types.push_back(revolute ? JointType::kRevolute : JointType::kPrismatic);
    t.rows.row(i) << random.uniform(-kPi, kPi), random.vector(1).head<2>().transpose(), random.uniform(-kPi, kPi),
        random.uniform(-kPi, kPi);
    const Eigen::Vector3d axis = random.chance(0.2) ? Eigen::Vector3d(0, 0, -1) : random.unit();
    const Eigen::Vector3d point = random.vector(1);
    t.screws.row(i).head<3>() = revolute ? axis : Eigen::Vector3d::Zero();
    t.screws.row(i).segment<3>(3) = revolute ? Eigen::Vector3d(-axis.cross(point)) : axis;
    t.screws(i, 6) = random.uniform(-1, 1);
    t.origin_xyz.push_back(random.vector(1));
    t.origin_rpy.push_back(random.vector(kPi));
    t.axes.row(i) = axis.transpose();
  }
  t.end = random.pose(1);
  t.base = random.pose(5);
  t.tool = random.pose(1);
  return t;
}

/// `given`: with its bodies; null: with none.
inline RobotModel build(const std::string& kind, const Tables& t, const RobotDescription* given = nullptr) {
  RobotDescription description;
  if (given != nullptr) description.bodies = given->bodies;
  description.joint_types = t.types;
  description.T_world_base = t.base;
  description.T_flange_tool = t.tool;
  if (kind == "dh") return build_dh(description, t.rows);
  if (kind == "mdh") return build_mdh(description, t.rows);
  if (kind == "poe") return build_poe(description, t.screws, t.end);
  std::vector<Pose> origins;
  for (std::size_t i = 0; i < t.types.size(); ++i)
    origins.push_back({rpy_to_rotation(t.origin_rpy[i]), t.origin_xyz[i]});
  return build_urdf(description, origins, t.axes, t.end);
}

/// A 6R arm of about 2 m reach, all rows DH; joints 2 and 3 parallel but for `angle` [rad]. Its tool is off every axis.
inline Tables six_axes(double angle = 0) {
  Tables t;
  t.types.assign(6, JointType::kRevolute);
  t.rows.resize(6, 5);
  t.rows << 0, 0.4, 0.15, -kPi / 2, 0,  //
      -kPi / 2, 0, 0.825, angle, 0,     //
      kPi / 2, 0, 0.1, kPi / 2, 0,      //
      0, 0.925, 0, -kPi / 2, 0,         //
      0, 0, 0, kPi / 2, 0,              //
      0, 0.11, 0, 0, 0;
  t.tool = {Eigen::Matrix3d::Identity(), {0.12, 0.04, 0.15}};
  return t;
}

}  // namespace fastcal::test
