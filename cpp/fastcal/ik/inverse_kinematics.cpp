// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/inverse_kinematics.hpp"

#include <limits>
#include <utility>

#include "fastcal/ik/row_solver.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {

void IkOptions::check(int joint_count) const {
  FASTCAL_CHECK(joint_count <= kMaxIkJoints)
      << "inverse kinematics takes arms of at most " << kMaxIkJoints << " joints, got " << joint_count;
  FASTCAL_CHECK(limits.rows() == joint_count && limits.cols() == 2)
      << "limits must have shape (" << joint_count << ", 2)";
  FASTCAL_CHECK(held.empty() || static_cast<int>(held.size()) == joint_count)
      << "held must be one a joint (" << joint_count << "), got " << held.size();
  FASTCAL_CHECK((limits.col(0).array() <= limits.col(1).array()).all())
      << "a lower limit must not lie above the upper one";
}
IkResult inverse_kinematics(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta_in,
                            const Samples& samples, const Eigen::Ref<const RowMatrixXd>& targets,
                            const IkOptions& options) {
  const int n = model.robot().joint_count();
  const Eigen::Index rows = targets.rows();
  samples.check(model.robot().tree());
  FASTCAL_CHECK(samples.count() == rows && targets.cols() == 16)
      << "targets must be (N, 4, 4) with a row of conditions each, got " << rows << " and " << samples.count();
  options.check(n);
  const Eigen::VectorXd theta = theta_in;
  IkResult out;
  out.q = samples.q.table();
  out.status.assign(static_cast<std::size_t>(rows), static_cast<int>(IkStatus::kBadTarget));
  out.iterations = Eigen::VectorXi::Zero(rows);
  out.position_error = out.rotation_error = Eigen::VectorXd::Constant(rows, std::numeric_limits<double>::quiet_NaN());
  const RowSolver solver(model, theta, options);
  const auto solve_rows = [&](Eigen::Index begin, Eigen::Index end, bool follows) {
    std::vector<IkRow> wanted;
    for (Eigen::Index i = begin; i < end; ++i) {
      if (follows) out.q.row(i) = out.q.row(i - 1);
      IkRow row{i, {}, out.q.row(i).transpose(), {}, {}, {}};
      if (to_target(targets.row(i).data(), row.target)) wanted.push_back(std::move(row));
    }
    const bool may_jump = !follows && options.restarts > 0;
    ModelFrames frames(model, theta, samples);
    solver.solve_chain(wanted, frames, may_jump ? options.restarts : 0);
    if (!model.effects().empty()) solver.approach(wanted, samples);
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
  samples.check(model.robot().tree());
  const Chain chain = model.robot().chain(theta.head(model.robot().nominal().size()));
  parallel_chunks(samples.count(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    RowEvaluator rows(model, theta);
    Samples part = samples.slice(begin, end);
    settle(model, theta, 1, part);
    Eigen::Matrix<double, 6, Eigen::Dynamic> here(6, n);
    for (Eigen::Index i = begin; i < end; ++i) {
      fill_joint_jacobian(chain, rows.frames(part.row(i - begin)), here);
      Eigen::Map<RowMatrixXd>(J + i * 6 * n, 6, n) = here;
    }
  });
}

}  // namespace fastcal
