// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/pose_search.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

constexpr double kLeastStep = 1e-15;  // of a radian or the reach: no step is smaller
constexpr double kLeastDamping = 1e-300;
constexpr double kMostDamping = 1e12;

Vector6d scale_of(const Goal& goal) {
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(1 / goal.reach), Eigen::Vector3d::Constant(goal.rotation_weight);
  return scale;
}

}  // namespace

SearchPoint look(const Chain& chain, const Goal& goal, const JointVector& q, std::span<const Pose> frames) {
  SearchPoint point{q, pose_error(goal.target, frames.back()), joint_jacobian(chain, frames)};
  point.position_error = point.error.head<3>().norm();
  point.rotation_error = point.error.tail<3>().norm();
  point.cost = scale_of(goal).cwiseProduct(point.error).squaredNorm();
  point.reached = point.position_error <= goal.tolerance_position && point.rotation_error <= goal.tolerance_rotation;
  return point;
}

JointVector step_from(const SearchPoint& point, const Goal& goal, double mu, const JointLimits& limits) {
  const Vector6d scale = scale_of(goal);
  return bounded_step(scale.asDiagonal() * point.J, scale.cwiseProduct(point.error), mu * point.cost + kLeastDamping,
                      limits, point.q);
}

SearchPoint search_pose(const Chain& chain, const FramesAt& frames_at, const Goal& goal, const JointLimits& limits,
                        const JointVector& q, int max_evaluations) {
  SearchPoint best = look(chain, goal, q, frames_at(q));
  int evaluations = 1;
  double mu = 0.1;
  while (!best.reached && evaluations < max_evaluations && mu < kMostDamping) {
    const JointVector to = step_from(best, goal, mu, limits);
    if ((to - best.q).cwiseAbs().maxCoeff() <= kLeastStep) break;
    SearchPoint next = look(chain, goal, to, frames_at(to));
    ++evaluations;
    if (next.cost < best.cost) {
      best = std::move(next);
      mu = std::max(mu / 5, 1e-12);
    } else {
      mu *= 8;
    }
  }
  best.evaluations = evaluations;
  return best;
}

double least_singular_value(const Chain& chain, const ToolJacobian& J, double reach) {
  ToolJacobian scaled = J;
  scaled.topRows<3>() /= reach;
  for (Eigen::Index i = 0; i < J.cols(); ++i) {
    if (chain.joint_types[static_cast<std::size_t>(i)] == JointType::kPrismatic) scaled.col(i) *= reach;
  }
  if (J.cols() < 6) {
    const Eigen::MatrixXd A = scaled.transpose() * scaled;
    return std::sqrt(
        std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues()[0]));
  }
  const Matrix6d A = scaled * scaled.transpose();
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Matrix6d>(A, Eigen::EigenvaluesOnly).eigenvalues()[0]));
}

}  // namespace fastcal
