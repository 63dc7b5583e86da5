// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/mass_matrix.hpp"

#include "fastcal/math/check.hpp"
#include "fastcal/robot/kinematics.hpp"

namespace fastcal {

void mass_matrices(const RobotModel& robot, const Eigen::Ref<const RowMatrixXd>& q, double* M) {
  const int n = robot.joint_count();
  FASTCAL_CHECK(robot.tree().is_serial() && robot.description().passive.empty())
      << "a mass matrix is of one arm without loops, got a tree of frames";
  FASTCAL_CHECK(q.cols() == n) << "q must have shape (N, " << n << "), got (" << q.rows() << ", " << q.cols() << ")";
  const Chain chain = robot.chain();
  std::vector<Pose> frames;
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, n);
  for (Eigen::Index row = 0; row < q.rows(); ++row) {
    forward(chain, q.row(row).data(), nullptr, frames);
    Eigen::Map<RowMatrixXd> out(M + row * n * n, n, n);
    out.setZero();
    for (int b = 0; b < n; ++b) {
      const auto k = static_cast<std::size_t>(b);
      const Body& body = robot.description().bodies[k];
      const Pose T = frames[static_cast<std::size_t>(joint_frame(b))] * chain.body_frames[k];
      const Eigen::Vector3d com = T * body.com;
      for (int i = 0; i <= b; ++i) {
        const bool revolute = chain.joint_types[static_cast<std::size_t>(i)] == JointType::kRevolute;
        const Vector6d along = revolute ? Vector6d::Unit(5) : Vector6d::Unit(2);
        J.col(i) = tool_motion(frames[static_cast<std::size_t>(joint_frame(i))], com, along);
      }
      const auto v = J.topLeftCorner(3, b + 1);
      const auto w = J.bottomLeftCorner(3, b + 1);
      out.topLeftCorner(b + 1, b + 1) +=
          body.mass * v.transpose() * v + w.transpose() * (T.R * body.inertia * T.R.transpose()) * w;
    }
  }
}

}  // namespace fastcal
