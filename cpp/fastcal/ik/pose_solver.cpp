// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/pose_solver.hpp"

#include <limits>
#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

IkOptions checked(IkOptions options, int joint_count) {
  options.check(joint_count);
  return options;
}

}  // namespace

PoseSolver::PoseSolver(ErrorModel model, Samples conditions, IkOptions options)
    : model_(std::move(model)),
      theta_(model_.start()),
      conditions_(std::move(conditions)),
      options_(checked(std::move(options), joint_count())),
      solver_(model_, theta_, options_),
      frames_(model_, theta_, conditions_) {
  conditions_.check(model_.robot().tree());
  FASTCAL_CHECK(conditions_.count() == 1) << "conditions must be one row, got " << conditions_.count();
}

IkStatus PoseSolver::solve(const double* target, const double* seed, SearchPoint& found) {
  const Eigen::Map<const Eigen::VectorXd> q(seed, joint_count());
  found = {};
  found.q = q;
  found.position_error = found.rotation_error = std::numeric_limits<double>::quiet_NaN();
  std::vector<IkRow> rows(1);
  IkRow& row = rows.front();
  row.seed = q;
  if (!q.allFinite() || !to_target(target, row.target)) return IkStatus::kBadTarget;
  const bool may_jump = options_.restarts > 0;
  solver_.solve_chain(rows, frames_, options_.restarts);
  if (!model_.effects().empty()) solver_.approach(rows, conditions_);
  return solver_.finish(row, frames_, may_jump, found);
}

const Pose& PoseSolver::forward(const double* q) {
  frames_.choose(0);
  return frames_.at(Eigen::Map<const Eigen::VectorXd>(q, joint_count())).back();
}

}  // namespace fastcal
