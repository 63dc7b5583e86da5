// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/bounded_step.hpp"

#include <Eigen/Householder>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fastcal/math/pivoted_lu.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/robot/assembly.hpp"

namespace fastcal {

namespace {

/// The columns of passive joints go into those of the joints that move them.
void follow_loops(const Chain& chain, std::span<const Pose> T_world_frame,
                  Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) {
  const std::vector<LoopRow> rows = loop_rows(chain, T_world_frame, nullptr, nullptr);
  const auto m = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd by(m, chain.joint_count()), passive(m, m);
  for (Eigen::Index r = 0; r < m; ++r) {
    for (int j = 0; j < chain.joint_count(); ++j)
      by(r, j) = by_joint(chain, rows[static_cast<std::size_t>(r)], T_world_frame, j, nullptr);
  }
  Eigen::MatrixXd of_passive(6, m);
  for (Eigen::Index p = 0; p < m; ++p) {
    const int joint = chain.passive[static_cast<std::size_t>(p)];
    passive.col(p) = by.col(joint);
    of_passive.col(p) = J.col(joint);
  }
  J -= of_passive * solve(Eigen::FullPivLU<Eigen::MatrixXd>(passive), by);
  for (const int joint : chain.passive) J.col(joint).setZero();
}

}  // namespace

ToolJacobian joint_jacobian(const Chain& chain, std::span<const Pose> T_world_frame) {
  ToolJacobian J(6, chain.joint_count());
  fill_joint_jacobian(chain, T_world_frame, J);
  return J;
}

void fill_joint_jacobian(const Chain& chain, std::span<const Pose> T_world_frame,
                         Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) {
  const Eigen::Vector3d& tool = T_world_frame.back().p;
  for (int i = 0; i < chain.joint_count(); ++i) {
    const int frame = chain.tree->frame_of_joint(i);
    if (!chain.is_serial() && !chain.tree->carries(frame, chain.frame_count() - 1)) {
      J.col(i).setZero();
      continue;
    }
    const Pose& T = T_world_frame[static_cast<std::size_t>(frame)];
    const Eigen::Vector3d axis = T.R.col(2);
    if (chain.joint_types[static_cast<std::size_t>(i)] == JointType::kRevolute)
      J.col(i) << axis.cross(tool - T.p), axis;
    else
      J.col(i) << axis, Eigen::Vector3d::Zero();
  }
  if (chain.has_loops()) follow_loops(chain, T_world_frame, J);
}

Vector6d pose_error(const Pose& target, const Pose& tool) {
  Vector6d e;
  e << target.p - tool.p, log_so3(target.R * tool.R.transpose());
  return e;
}

namespace {

constexpr int kMostRows = kMaxIkJoints + 6;

/// Q R of a matrix of few columns by Householder's reflections one after the other, as Eigen's HouseholderQR makes it
/// of so few: that compiles its blocks for each type as well, which takes longer than all the rest of this file.
template <typename Matrix>
class SmallQr {
 public:
  explicit SmallQr(Matrix matrix) : qr_(std::move(matrix)) {
    Row work(qr_.cols());
    scale_.resize(qr_.cols());
    for (Eigen::Index k = 0; k < qr_.cols(); ++k) {
      double beta = 0;
      qr_.col(k).tail(qr_.rows() - k).makeHouseholderInPlace(scale_[k], beta);
      qr_(k, k) = beta;
      qr_.bottomRightCorner(qr_.rows() - k, qr_.cols() - k - 1)
          .applyHouseholderOnTheLeft(qr_.col(k).tail(qr_.rows() - k - 1), scale_[k], work.data() + k + 1);
    }
  }

  /// R^-1 b, and R^-T b.
  template <typename Vector>
  Vector solved(const Vector& b) const {
    return qr_.topRows(qr_.cols()).template triangularView<Eigen::Upper>().solve(b);
  }
  template <typename Vector>
  Vector solved_transposed(const Vector& b) const {
    return qr_.topRows(qr_.cols()).transpose().template triangularView<Eigen::Lower>().solve(b);
  }

  /// z (rows) becomes Q z, or Q^T z.
  template <typename Vector>
  void turn(Vector& z) const {
    for (Eigen::Index k = qr_.cols() - 1; k >= 0; --k) reflect(z, k);
  }
  template <typename Vector>
  void turn_back(Vector& z) const {
    for (Eigen::Index k = 0; k < qr_.cols(); ++k) reflect(z, k);
  }

 private:
  using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMaxIkJoints>;

  template <typename Vector>
  void reflect(Vector& z, Eigen::Index k) const {
    double work = 0;
    z.tail(qr_.rows() - k).applyHouseholderOnTheLeft(qr_.col(k).tail(qr_.rows() - k - 1), scale_[k], &work);
  }

  Matrix qr_;
  Row scale_;
};

/// By orthogonal triangles, since the squares in J J^T drown the direction in which a nearly singular arm still moves.
/// Of two ways the one whose matrix has full rank: with six joints and more the shortest (dq, s) with
/// J dq + sqrt(damping) s = e, with fewer the least squares of [J; sqrt(damping) 1] dq = [e; 0].
JointVector damped_step(const ToolJacobian& J, const Vector6d& e, double damping, std::ptrdiff_t moving) {
  const Eigen::Index n = J.cols();
  const double root = std::sqrt(damping);
  if (moving >= 6) {
    Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMostRows, 6> B(n + 6, 6);
    B.topRows(n) = J.transpose();
    B.bottomRows<6>() = root * Matrix6d::Identity();
    const SmallQr<decltype(B)> qr(B);
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostRows, 1> z(n + 6);
    z.setZero();
    z.head<6>() = qr.solved_transposed(e);
    qr.turn(z);
    return z.head(n);
  }
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostRows, kMaxIkJoints> B(n + 6, n);
  B.topRows<6>() = J;
  B.bottomRows(n) = root * Eigen::MatrixXd::Identity(n, n);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostRows, 1> rhs(n + 6);
  rhs << e, Eigen::VectorXd::Zero(n);
  const SmallQr<decltype(B)> qr(B);
  qr.turn_back(rhs);
  return qr.solved(JointVector(rhs.head(n)));
}

}  // namespace

JointVector bounded_step(const ToolJacobian& J, const Vector6d& e, double damping, const JointLimits& limits,
                         const JointVector& q) {
  const Eigen::Index n = q.size();
  ToolJacobian free = J;
  Vector6d rest = e;
  JointVector out = q;
  std::array<bool, kMaxIkJoints> held{};
  for (Eigen::Index i = 0; i < n; ++i) {
    const double pull = J.col(i).dot(e);
    held[static_cast<std::size_t>(i)] =
        J.col(i).isZero(0) || (q[i] <= limits(i, 0) && pull < 0) || (q[i] >= limits(i, 1) && pull > 0);
    if (held[static_cast<std::size_t>(i)]) free.col(i).setZero();
  }
  for (Eigen::Index round = 0; round <= n; ++round) {
    const JointVector dq = damped_step(free, rest, damping, std::count(held.begin(), held.begin() + n, false));
    bool stopped = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (held[static_cast<std::size_t>(i)]) continue;
      const double to = q[i] + dq[i];
      out[i] = to < limits(i, 0) ? limits(i, 0) : to > limits(i, 1) ? limits(i, 1) : to;
      if (out[i] == to) continue;
      held[static_cast<std::size_t>(i)] = stopped = true;
      rest -= J.col(i) * (out[i] - q[i]);
      free.col(i).setZero();
    }
    if (!stopped) break;
  }
  return out;
}

}  // namespace fastcal
