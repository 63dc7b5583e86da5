// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Inverse kinematics of arms that branch or have closed loops: Newton on the joints that motors move, the loops closed
// in every posture. With fewer than six such joints the point is reached, and of the turn what they can; with two the
// nearest point of the surface that they keep to. A long step may lead through a fold of the loops into another way of
// assembly, where the motors alone do not bring the robot.
#include <algorithm>

#include "fastcal/ik/row_solver.hpp"
#include "fastcal/robot/assembly.hpp"

namespace fastcal {
namespace {

constexpr int kEvaluations = 120;
constexpr double kTurnCounts = 1e-4;  // beside the point, of an arm of fewer than six joints
constexpr double kTurnLeft = 0.035;   // [rad] more than that is another pose; less may be its own error
constexpr double kTiltLeft = 0.2;     // [rad] the same of three motors and fewer, whose turn points may not have shown
constexpr double kPointLeft = 0.005;  // [m] the same of a point, of two motors and fewer, which keep to a surface
constexpr double kSingular = 1e-6;    // as of a chain
constexpr double kAtLimit = 1e-9;     // [rad], [m]
constexpr double kGained = 1e-6;      // [rad], [m] beyond a limit: less is rounding
constexpr double kAcross = 1e-3;      // cosine: at right angles
constexpr double kSamePlace = 1e-4;   // [rad], [m] of passive joints: the same way of assembly

}  // namespace

IkStatus RowSolver::finish_tree(const IkRow& row, ModelFrames& frames, bool may_jump, SearchPoint& best) const {
  frames.choose(row.index);
  const FramesAt frames_at = [&](const JointVector& q) -> const std::vector<Pose>& { return frames.at(q); };
  const int motors = chain_.joint_count() - static_cast<int>(chain_.passive.size());
  Goal goal = goal_of(row);
  if (motors < 6) {
    goal.rotation_weight = kTurnCounts;
    goal.tolerance_rotation = 0;  // to the end: what is left of the turn is least there
  }
  const double tilt = motors > 3 ? kTurnLeft : kTiltLeft;
  const double off = motors > 2 ? options_.tolerance_position : std::max(options_.tolerance_position, kPointLeft);
  int evaluations = 0;
  Assembler assembler(chain_);
  const auto closed = [&](const JointVector& q) {
    frames.at(q);
    return frames.closed(q);
  };
  const auto assembled = [&](JointVector q) {
    if (chain_.has_loops()) assembler.assemble(q.data());
    return q;
  };
  const auto search = [&](const JointLimits& limits, const JointVector& from) {
    SearchPoint found = search_pose(chain_, frames_at, goal, held_at(row.seed, limits), from, kEvaluations);
    evaluations += found.evaluations;
    return found;
  };
  const auto stands_at = [&](const JointLimits& limits, const JointVector& q) {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const bool is_passive = std::find(chain_.passive.begin(), chain_.passive.end(), i) != chain_.passive.end();
      if (is_passive || is_held(i)) continue;
      if (q[i] <= limits(i, 0) + kAtLimit || q[i] >= limits(i, 1) - kAtLimit) return true;
    }
    return false;
  };
  // Does the surface that the point keeps to stand across what is left of the way?
  const auto is_foot = [&](const SearchPoint& found) {
    for (Eigen::Index i = 0; i < found.J.cols(); ++i) {
      const Eigen::Vector3d along = found.J.col(i).head<3>();
      if (std::abs(along.dot(found.error.head<3>())) > kAcross * along.norm() * found.position_error) return false;
    }
    return true;
  };
  // Of fewer than six motors: is what is left the loops' doing, not a limit's?
  const auto is_nearest = [&](const JointLimits& limits, const SearchPoint& found) {
    if (found.position_error > off || found.rotation_error > tilt) return false;
    if (found.position_error > options_.tolerance_position && !is_foot(found)) return false;
    if (found.position_error <= options_.tolerance_position && found.rotation_error <= options_.tolerance_rotation)
      return true;
    if (!stands_at(limits, found.q)) return true;
    const SearchPoint beyond = search(unlimited_, found.q);
    return beyond.rotation_error >= found.rotation_error - kGained &&
           beyond.position_error >= found.position_error - kGained;
  };
  const auto reach = [&](const JointLimits& limits, JointVector from) {
    SearchPoint found;
    for (int attempt = 0; attempt < 2; ++attempt) {
      found = search(limits, from);
      if (motors < 6) found.reached = is_nearest(limits, found);
      if (!found.reached || !chain_.has_loops()) break;
      const JointVector there = closed(found.q);
      from = closed(assembled(there));
      if ((from - there).cwiseAbs().maxCoeff() <= kSamePlace) break;
      found = look(chain_, goal, from, frames.at(from));
    }
    return found;
  };
  best = reach(limits_, row.seed);
  for (int k = 1; !best.reached && may_jump && k <= options_.restarts; ++k) {
    JointVector from = within_.restart(row.index, k);
    for (const int joint : chain_.passive) from[joint] = row.seed[joint];
    for (Eigen::Index i = 0; i < from.size(); ++i) {
      if (is_held(i)) from[i] = row.seed[i];
    }
    SearchPoint found = reach(limits_, assembled(from));
    if (found.reached || found.cost < best.cost) best = std::move(found);
  }
  IkStatus status = IkStatus::kReached;
  if (!best.reached) {
    status = reach(unlimited_, best.q).reached ? IkStatus::kLimit : IkStatus::kUnreachable;
  } else if (motors >= 6 && least_singular_value(chain_, best.J, options_.reach) < kSingular) {
    status = IkStatus::kSingular;
  }
  best.q = closed(best.q);
  best.evaluations = evaluations;
  return status;
}

}  // namespace fastcal
