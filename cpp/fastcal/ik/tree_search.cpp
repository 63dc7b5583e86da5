// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Inverse kinematics of arms that branch or have closed loops: Newton on the joints that motors move, the loops closed
// in every posture. With fewer than six such joints the point is reached, and of the turn what they can.
#include <algorithm>

#include "fastcal/ik/row_solver.hpp"

namespace fastcal {
namespace {

constexpr int kEvaluations = 120;
constexpr double kTurnCounts = 1e-4;  // beside the point, of an arm of fewer than six joints
constexpr double kTurnLeft = 0.035;   // [rad] more than that is another pose; less may be its own error
constexpr double kSingular = 1e-6;    // as of a chain

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
  int evaluations = 0;
  const auto reach = [&](const JointLimits& limits, const JointVector& from) {
    SearchPoint found = search_pose(chain_, frames_at, goal, held_at(row.seed, limits), from, kEvaluations);
    evaluations += found.evaluations;
    if (motors < 6)
      found.reached = found.position_error <= options_.tolerance_position && found.rotation_error <= kTurnLeft;
    return found;
  };
  best = reach(limits_, row.seed);
  for (int k = 1; !best.reached && may_jump && k <= options_.restarts; ++k) {
    JointVector from = within_.restart(row.index, k);
    for (const int joint : chain_.passive) from[joint] = row.seed[joint];
    for (Eigen::Index i = 0; i < from.size(); ++i) {
      if (is_held(i)) from[i] = row.seed[i];
    }
    SearchPoint found = reach(limits_, from);
    if (found.reached || found.cost < best.cost) best = std::move(found);
  }
  IkStatus status = IkStatus::kReached;
  if (!best.reached) {
    status = reach(unlimited_, best.q).reached ? IkStatus::kLimit : IkStatus::kUnreachable;
  } else if (motors >= 6 && least_singular_value(chain_, best.J, options_.reach) < kSingular) {
    status = IkStatus::kSingular;
  }
  frames.at(best.q);
  best.q = frames.closed(best.q);
  best.evaluations = evaluations;
  return status;
}

}  // namespace fastcal
