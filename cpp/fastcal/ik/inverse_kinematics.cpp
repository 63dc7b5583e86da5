// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/inverse_kinematics.hpp"

#include <limits>
#include <utility>

#include "fastcal/ik/row_solver.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {
namespace {

constexpr double kNotRotation = 1e-6;  // R R^T - 1

bool to_target(const double* numbers, Pose& target) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(numbers);
  if (!T.allFinite() || T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return false;
  target = {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  const Eigen::Matrix3d excess = target.R.transpose() * target.R - Eigen::Matrix3d::Identity();
  if (excess.cwiseAbs().maxCoeff() > kNotRotation || target.R.determinant() < 0) return false;
  target.R -= 0.5 * target.R * excess;  // rounded numbers: a Newton step to the nearest rotation
  return true;
}

}  // namespace

IkResult inverse_kinematics(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta_in,
                            const Samples& samples, const Eigen::Ref<const RowMatrixXd>& targets,
                            const IkOptions& options) {
  const int n = model.robot().joint_count();
  const Eigen::Index rows = targets.rows();
  samples.check(n);
  FASTCAL_CHECK(n <= kMaxIkJoints) << "inverse kinematics takes arms of at most " << kMaxIkJoints << " joints, got "
                                   << n;
  FASTCAL_CHECK(samples.count() == rows && targets.cols() == 16)
      << "targets must be (N, 4, 4) with a row of conditions each, got " << rows << " and " << samples.count();
  FASTCAL_CHECK(options.limits.rows() == n && options.limits.cols() == 2) << "limits must have shape (" << n << ", 2)";
  FASTCAL_CHECK(options.held.empty() || static_cast<int>(options.held.size()) == n)
      << "held must be one a joint (" << n << "), got " << options.held.size();
  FASTCAL_CHECK((options.limits.col(0).array() <= options.limits.col(1).array()).all())
      << "a lower limit must not lie above the upper one";
  const Eigen::VectorXd theta = theta_in;
  IkResult out;
  out.q = samples.q;
  out.status.assign(static_cast<std::size_t>(rows), static_cast<int>(IkStatus::kBadTarget));
  out.iterations = Eigen::VectorXi::Zero(rows);
  out.position_error = out.rotation_error = Eigen::VectorXd::Constant(rows, std::numeric_limits<double>::quiet_NaN());
  const RowSolver solver(model, theta, options);
  const auto solve_rows = [&](Eigen::Index begin, Eigen::Index end, bool follows) {
    std::vector<IkRow> wanted;
    for (Eigen::Index i = begin; i < end; ++i) {
      if (follows) out.q.row(i) = out.q.row(i - 1);
      IkRow row{i, {}, out.q.row(i).transpose(), {}, {}};
      if (to_target(targets.row(i).data(), row.target)) wanted.push_back(std::move(row));
    }
    const bool may_jump = !follows && options.restarts > 0;
    solver.solve_chain(wanted, may_jump ? options.restarts : 0);
    if (!model.effects().empty()) solver.approach(wanted, samples);
    ModelFrames frames(model, theta, samples);
    for (const IkRow& row : wanted) {
      SearchPoint found;
      const IkStatus status = solver.finish(row, frames, may_jump, found);
      out.status[static_cast<std::size_t>(row.index)] = static_cast<int>(status);
      out.q.row(row.index) = found.q.transpose();
      out.iterations[row.index] = found.evaluations;
      out.position_error[row.index] = found.position_error;
      out.rotation_error[row.index] = found.rotation_error;
    }
  };
  if (options.along_path) {
    for (Eigen::Index i = 0; i < rows; ++i) solve_rows(i, i + 1, i > 0);
  } else {
    parallel_chunks(rows, options.threads,
                    [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) { solve_rows(begin, end, false); });
  }
  return out;
}

void joint_jacobian(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, const Samples& samples,
                    int threads, double* J) {
  const int n = model.robot().joint_count();
  samples.check(n);
  const Chain chain = model.robot().chain(theta.head(model.robot().nominal().size()));
  parallel_chunks(samples.count(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    RowEvaluator rows(model, theta);
    Samples part = samples.slice(begin, end);
    settle(model, theta, 1, part);
    for (Eigen::Index i = begin; i < end; ++i)
      Eigen::Map<RowMatrixXd>(J + i * 6 * n, 6, n) = joint_jacobian(chain, rows.frames(part.row(i - begin)));
  });
}

}  // namespace fastcal
