// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Which postures can be measured: the arm keeps out of boxes, the tool stays in a region, and the instrument sees the
// target. The arm is a chain of straight links between the origins of its frames, each `link_radius` thick. All points
// are in the measuring frame [m].
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "fastcal/robot/robot_model.hpp"

namespace fastcal::design {

struct Box {
  Eigen::Vector3d low, high;
};

struct Tracker {
  Eigen::Vector3d position;
  double nearest = 0;  ///< [m] of the range in which it measures
  double farthest = std::numeric_limits<double>::infinity();
  /// Where the reflector looks, in the tool's axes; zero: it is turned towards the tracker by hand, or sees all around.
  Eigen::Vector3d reflector = Eigen::Vector3d::Zero();
  double acceptance = 0;  ///< [rad] largest angle between that and the beam
};

struct Surroundings {
  std::vector<Box> keep_out;
  std::optional<Box> region;  ///< of the tool's point
  std::optional<Tracker> tracker;
  double link_radius = 0;  ///< [m]
};

/// Why a posture cannot be measured, the first that holds.
enum class Obstacle { kNone, kKeepOut, kRegion, kRange, kAcceptance, kSight };

/// One a posture, q (N, n). Keep-out boxes stop links from the second joint on (what is on the floor does not move
/// away from it) and the beam; links up to the last joint's origin hide the beam, the tool carries the target.
std::vector<Obstacle> obstacles(const RobotModel& robot, const Surroundings& surroundings,
                                const Eigen::Ref<const RowMatrixXd>& q, int threads);

/// Does the straight line from a to b meet the box, `margin` wider on all sides?
bool meets(const Box& box, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double margin);

/// Least distance between the segments a b and c d.
double segment_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                        const Eigen::Vector3d& d);

}  // namespace fastcal::design
