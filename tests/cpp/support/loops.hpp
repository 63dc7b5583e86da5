// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Small robots with closed loops, of each kind of loop.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "support/robots.hpp"

namespace fastcal::test {

/// A joint of a robot with loops: where it stands, from its parent's link, and its axis.
struct Mount {
  int parent;
  JointType type;
  Eigen::Vector3d at, axis;
  double start = 0;
  bool passive = false;
};

inline RobotModel closed(const std::vector<Mount>& mounts, std::vector<Loop> loops, const Eigen::Vector3d& tool) {
  RobotDescription description;
  const auto n = static_cast<Eigen::Index>(mounts.size());
  description.home.resize(n);
  std::vector<Pose> origins;
  RowMatrixXd axes(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Mount& mount = mounts[static_cast<std::size_t>(i)];
    description.joint_types.push_back(mount.type);
    description.parents.push_back(mount.parent);
    if (mount.passive) description.passive.push_back(static_cast<int>(i));
    description.home[i] = mount.start;
    origins.push_back({Eigen::Matrix3d::Identity(), mount.at});
    axes.row(i) = mount.axis.transpose();
  }
  description.bodies.resize(mounts.size());
  description.coupling = Eigen::MatrixXd::Zero(n, n);
  description.T_flange_tool.p = tool;
  description.loops = std::move(loops);
  return build_urdf(description, origins, axes, Pose());
}

inline Loop rod(const std::string& name, int from, int to, const Eigen::Vector3d& p_from, const Eigen::Vector3d& p_to,
                double length) {
  Loop out;
  out.name = name;
  out.kind = Loop::Kind::kRod;
  out.frames = {to, from};
  out.from.p = p_from;
  out.to.p = p_to;
  out.length = length;
  return out;
}

/// Two motors 200 mm apart, cranks of 200, rods of 320 that meet at the tool, above (side 1) or below the cranks' ends.
inline RobotModel five_bar(double side = 1, double length = 0.32) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const JointType turns = JointType::kRevolute;
  return closed({{-1, turns, {-0.1, 0, 0}, z, 2 * kPi / 3},
                 {-1, turns, {0.1, 0, 0}, z, kPi / 3},
                 {1, turns, {0.2, 0, 0}, z, side > 0 ? 1.0 : 3.2, true}},
                {rod("rod", link_frame(0), 7, {0.2, 0, 0}, Eigen::Vector3d::Zero(), length)}, {0.32, 0, 0});
}

/// A parallelogram of hinges, 300 mm by 500, its last pin `fixed` to the base.
inline RobotModel four_bar(const std::vector<int>& fixed) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const JointType turns = JointType::kRevolute;
  Loop pin;
  pin.name = "pin";
  pin.frames = {link_frame(2), 0};
  pin.from.p = {0.5, 0, 0};
  pin.to.p = {0.3, 0, 0};
  pin.fixed = fixed;
  std::vector<Mount> mounts{{-1, turns, {0, 0, 0}, z, 1.2},
                            {0, turns, {0.3, 0, 0}, z, -1.2, true},
                            {1, turns, {0.5, 0, 0}, z, 1.2 - kPi, true}};
  if (fixed.size() == 6) {  // a weld needs the last hinge too
    mounts.push_back({2, turns, {0.3, 0, 0}, z, kPi - 1.2, true});
    pin.frames.target = link_frame(3);
    pin.to.p.setZero();
  }
  return closed(mounts, {pin}, {0.05, 0, 0});
}

/// Belts hold the wrist level: q4 = -(q2 + q3).
inline RobotModel palletizer() {
  const JointType turns = JointType::kRevolute;
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  Loop belt;
  belt.name = "belt";
  belt.kind = Loop::Kind::kGear;
  belt.driven = 3;
  belt.joints = {{1, -1.0}, {2, -1.0}};
  return closed({{-1, turns, {0, 0, 0.5}, z},
                 {0, turns, {0.2, 0, 0}, y, -0.3},
                 {1, turns, {0, 0, 0.8}, y, 1.0},
                 {2, turns, {0.9, 0, 0}, y, -0.7, true},
                 {3, turns, {0.15, 0, -0.1}, z}},
                {belt}, {0, 0, 0});
}

/// Six legs of 450 mm that screws lengthen.
inline RobotModel hexapod() {
  std::vector<Mount> mounts;
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  for (int k = 0; k < 6; ++k) mounts.push_back({-1, JointType::kPrismatic, Eigen::Vector3d::Zero(), z});
  for (int k = 0; k < 6; ++k)
    mounts.push_back({k == 0 ? -1 : 5 + k, k < 3 ? JointType::kPrismatic : JointType::kRevolute,
                      Eigen::Vector3d::Zero(), Eigen::Vector3d::Unit(k % 3), k == 2 ? 0.4 : 0.0, true});
  std::vector<Loop> legs;
  for (int k = 0; k < 6; ++k) {
    constexpr double degree = kPi / 180;
    const double at = degree * (120 * ((k + 1) / 2) + (k % 2 == 0 ? 10 : -10));
    const double on = degree * (120 * (k / 2) + (k % 2 == 0 ? 50 : 70));
    legs.push_back(rod("leg" + std::to_string(k + 1), 0, link_frame(11),
                       0.3 * Eigen::Vector3d(std::cos(at), std::sin(at), 0),
                       0.15 * Eigen::Vector3d(std::cos(on), std::sin(on), 0), 0.45));
    legs.back().joints = {{k, 1.0}};
  }
  return closed(mounts, legs, Eigen::Vector3d::Zero());
}

}  // namespace fastcal::test
