// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How an instrument at the origin of the measuring frame, its vertical axis along z, sees a point.
#pragma once

#include <cmath>
#include <utility>

#include "fastcal/effects/owners.hpp"

namespace fastcal {

struct Sight {
  Eigen::Vector3d p;        ///< [m] the point
  double level;             ///< [m] its distance from the vertical axis
  double range;             ///< [m] from the instrument
  Eigen::Vector3d forward;  ///< level, unit; x where the point is above the instrument

  explicit Sight(Eigen::Vector3d point)
      : p(std::move(point)),
        level(std::hypot(p.x(), p.y())),
        range(p.norm()),
        forward(level > 0 ? Eigen::Vector3d(p.x() / level, p.y() / level, 0) : Eigen::Vector3d::UnitX()) {}

  /// Motion of the point by azimuth and by elevation [m/rad], and along the line of sight (unit).
  Eigen::Vector3d around() const { return level * Eigen::Vector3d::UnitZ().cross(forward); }
  Eigen::Vector3d up() const { return level * Eigen::Vector3d::UnitZ() - p.z() * forward; }
  Eigen::Vector3d outward() const { return range > 0 ? (p / range).eval() : Eigen::Vector3d::UnitX(); }
};

/// The body twist of the tool's frame that moves it by so much [m] along the line of sight; none at the instrument.
inline Vector6d along_sight(const Pose& tool, double amount) {
  Vector6d xi = Vector6d::Zero();
  const double range = tool.p.norm();
  if (range > 0) xi.head<3>() = tool.R.transpose() * tool.p * (amount / range);
  return xi;
}

}  // namespace fastcal
