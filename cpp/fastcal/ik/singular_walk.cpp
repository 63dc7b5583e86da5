// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/singular_walk.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

constexpr double kStep = 0.15;        // [rad] along the curve
constexpr double kWay = 4 * M_PI;     // [rad] in all joints together: two of them a turn each, and more
constexpr int kCorrections = 6;       // back to the curve
constexpr double kOnTheCurve = 0.01;  // of the tolerance
constexpr int kFalsePositions = 40;

/// A posture of the curve.
struct Place {
  SearchPoint point;
  Vector6d u = Vector6d::Zero();  // the direction in which the tool hardly moves
  JointVector v;                  // the motion of the joints that leaves the tool where it is
  double height = 0;              // the error along u, lengths over the reach
  bool on_curve = false;
};

class Walk {
 public:
  Walk(const Chain& chain, const FramesAt& frames_at, const Goal& goal, const JointLimits& limits)
      : chain_(chain), frames_at_(frames_at), goal_(goal), limits_(limits) {
    unit_ << Eigen::Vector3d::Constant(1 / goal.reach), Eigen::Vector3d::Ones();
    tolerance_ = kOnTheCurve * std::min(goal.tolerance_position / goal.reach, goal.tolerance_rotation);
  }

  /// The posture of the curve next to q; u and v as they were `before`, not turned round.
  Place place(JointVector q, const Place* before) {
    Place out;
    for (int k = 0; k < kCorrections; ++k) {
      out.point = look(chain_, goal_, q, frames_at_(q));
      ++evaluations_;
      ToolJacobian J = unit_.asDiagonal() * out.point.J;
      for (Eigen::Index i = 0; i < q.size(); ++i) {
        if (limits_(i, 0) == limits_(i, 1)) J.col(i).setZero();
      }
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Eigen::MatrixXd(J), Eigen::ComputeFullU | Eigen::ComputeFullV);
      out.u = svd.matrixU().col(5);
      out.v = svd.matrixV().col(5);
      if (before != nullptr && out.u.dot(before->u) < 0) out.u = -out.u;
      if (before != nullptr && out.v.dot(before->v) < 0) out.v = -out.v;
      const Vector6d e = unit_.cwiseProduct(out.point.error);
      out.height = out.u.dot(e);
      out.on_curve = (e - out.height * out.u).norm() <= tolerance_;
      if (out.on_curve || out.point.reached) break;
      JointVector dq = JointVector::Zero(q.size());
      for (int i = 0; i < 5; ++i) dq += svd.matrixV().col(i) * (svd.matrixU().col(i).dot(e) / svd.singularValues()[i]);
      if (!(dq.norm() < kStep)) break;
      q += dq;
    }
    const auto low = limits_.col(0).array();
    const auto high = limits_.col(1).array();
    if (!(out.point.q.array() >= low).all() || !(out.point.q.array() <= high).all())
      out.on_curve = out.point.reached = false;
    return out;
  }

  /// From a posture along its v until the pose is reached, the limits stand in the way or the way is long.
  SearchPoint follow(Place at) {
    for (double way = 0; way < kWay && at.on_curve && !at.point.reached; way += kStep) {
      Place next = place(at.point.q + kStep * at.v, &at);
      if (next.on_curve && (next.height > 0) != (at.height > 0)) return between(at, next);
      at = std::move(next);
    }
    return at.point;
  }

  int evaluations() const { return evaluations_; }

 private:
  /// False position with the Illinois rule between two postures of the curve, heights of either sign.
  SearchPoint between(const Place& first, const Place& last) {
    double low = 0, high = kStep;
    double below = first.height, above = last.height;
    int side = 0;
    Place at = last;
    for (int k = 0; k < kFalsePositions && at.on_curve && !at.point.reached; ++k) {
      const double s = (low * above - high * below) / (above - below);
      at = place(first.point.q + s * first.v, &first);
      const int now = (at.height > 0) == (below > 0) ? -1 : 1;
      (now < 0 ? low : high) = s;
      (now < 0 ? below : above) = at.height;
      if (now == side) (now < 0 ? above : below) *= 0.5;
      side = now;
    }
    return at.point;
  }

  const Chain& chain_;
  const FramesAt& frames_at_;
  const Goal& goal_;
  const JointLimits& limits_;
  Vector6d unit_;
  double tolerance_;
  int evaluations_ = 0;
};

}  // namespace

SearchPoint walk_singular(const Chain& chain, const FramesAt& frames_at, const Goal& goal, const JointLimits& limits,
                          const JointVector& q) {
  Walk walk(chain, frames_at, goal, limits);
  Place start = walk.place(q, nullptr);
  SearchPoint best = start.point;
  for (int direction = 0; direction < 2 && !best.reached; ++direction) {
    SearchPoint end = walk.follow(start);
    if (end.reached) best = std::move(end);
    start.v = -start.v;
  }
  best.evaluations = walk.evaluations();
  return best;
}

}  // namespace fastcal
