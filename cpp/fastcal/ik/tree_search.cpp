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

/// The search of one row, within one set of limits after another.
class RowSolver::TreeSearch {
 public:
  TreeSearch(const RowSolver& solver, const IkRow& row, ModelFrames& frames)
      : solver_(solver),
        chain_(solver.chain_),
        options_(solver.options_),
        row_(row),
        frames_(frames),
        goal_(solver.goal_of(row)),
        assembler_(solver.chain_),
        motors_(chain_.joint_count() - static_cast<int>(chain_.passive.size())),
        tilt_left_(motors_ > 3 ? kTurnLeft : kTiltLeft),
        point_left_(motors_ > 2 ? options_.tolerance_position : std::max(options_.tolerance_position, kPointLeft)) {
    if (motors_ >= 6) return;
    goal_.rotation_weight = kTurnCounts;
    goal_.tolerance_rotation = 0;  // to the end: what is left of the turn is least there
  }

  /// The nearest posture from `from` on, and whether the motors alone bring the robot there.
  SearchPoint reach(const JointLimits& limits, JointVector from) {
    SearchPoint found;
    for (int attempt = 0; attempt < 2; ++attempt) {
      found = search(limits, from);
      if (motors_ < 6) found.reached = is_nearest(limits, found);
      if (!found.reached || !chain_.has_loops()) break;
      const JointVector there = closed(found.q);
      from = closed(assembled(there));
      if ((from - there).cwiseAbs().maxCoeff() <= kSamePlace) break;
      found = look(chain_, goal_, from, frames_.at(from));
    }
    return found;
  }

  /// The k-th posture to begin again from, the joints that are held as the row's seed has them.
  JointVector restart(int k) {
    JointVector from = solver_.within_.restart(row_.index, k);
    for (Eigen::Index i = 0; i < from.size(); ++i) {
      if (solver_.is_held(i)) from[i] = row_.seed[i];
    }
    return assembled(std::move(from));
  }

  /// The posture with its loops closed from where it is.
  JointVector closed(const JointVector& q) const {
    frames_.at(q);
    return frames_.closed(q);
  }

  bool moves_freely() const { return motors_ >= 6; }
  int evaluations() const { return evaluations_; }

 private:
  /// The posture to which the motors lead from home.
  JointVector assembled(JointVector q) {
    if (chain_.has_loops()) assembler_.assemble(q.data());
    return q;
  }

  SearchPoint search(const JointLimits& limits, const JointVector& from) {
    const FramesAt frames_at = [&](const JointVector& q) -> const std::vector<Pose>& { return frames_.at(q); };
    SearchPoint found = search_pose(chain_, frames_at, goal_, solver_.held_at(row_.seed, limits), from, kEvaluations);
    evaluations_ += found.evaluations;
    return found;
  }

  bool stands_at(const JointLimits& limits, const JointVector& q) const {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const bool is_passive = std::find(chain_.passive.begin(), chain_.passive.end(), i) != chain_.passive.end();
      if (is_passive || solver_.is_held(i)) continue;
      if (q[i] <= limits(i, 0) + kAtLimit || q[i] >= limits(i, 1) - kAtLimit) return true;
    }
    return false;
  }

  /// Does the surface that the point keeps to stand across what is left of the way?
  static bool is_foot(const SearchPoint& found) {
    for (Eigen::Index i = 0; i < found.J.cols(); ++i) {
      const Eigen::Vector3d along = found.J.col(i).head<3>();
      if (std::abs(along.dot(found.error.head<3>())) > kAcross * along.norm() * found.position_error) return false;
    }
    return true;
  }

  /// Of fewer than six motors: is what is left the loops' doing, not a limit's?
  bool is_nearest(const JointLimits& limits, const SearchPoint& found) {
    if (found.position_error > point_left_ || found.rotation_error > tilt_left_) return false;
    const bool at_point = found.position_error <= options_.tolerance_position;
    if (!at_point && !is_foot(found)) return false;
    if (at_point && found.rotation_error <= options_.tolerance_rotation) return true;
    if (!stands_at(limits, found.q)) return true;
    const SearchPoint beyond = search(solver_.unlimited_, found.q);
    return beyond.rotation_error >= found.rotation_error - kGained &&
           beyond.position_error >= found.position_error - kGained;
  }

  const RowSolver& solver_;
  const Chain& chain_;
  const IkOptions& options_;
  const IkRow& row_;
  ModelFrames& frames_;
  Goal goal_;
  Assembler assembler_;
  int motors_;
  double tilt_left_, point_left_;
  int evaluations_ = 0;
};

IkStatus RowSolver::finish_tree(const IkRow& row, ModelFrames& frames, bool may_jump, SearchPoint& best) const {
  frames.choose(row.index);
  TreeSearch search(*this, row, frames);
  best = search.reach(limits_, row.seed);
  for (int k = 1; !best.reached && may_jump && k <= options_.restarts; ++k) {
    SearchPoint found = search.reach(limits_, search.restart(k));
    if (found.reached || found.cost < best.cost) best = std::move(found);
  }
  IkStatus status = IkStatus::kReached;
  if (!best.reached) {
    status = search.reach(unlimited_, best.q).reached ? IkStatus::kLimit : IkStatus::kUnreachable;
  } else if (search.moves_freely() && least_singular_value(chain_, best.J, options_.reach) < kSingular) {
    status = IkStatus::kSingular;
  }
  best.q = search.closed(best.q);
  best.evaluations = search.evaluations();
  return status;
}

}  // namespace fastcal
