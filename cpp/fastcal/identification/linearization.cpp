// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/linearization.hpp"

#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {

Linearization linearize(const Problem& problem, const Eigen::VectorXd& theta, const CommonNoise& tau) {
  problem.check();
  FASTCAL_CHECK(theta.size() == problem.parameter_count())
      << "theta must hold " << problem.parameter_count() << " numbers, got " << theta.size();
  const int p = problem.model.parameter_count();
  Samples samples = problem.samples;
  settle(problem.model, theta.head(p), problem.threads, samples);
  const Eigen::Matrix3Xd anchors =
      Eigen::Map<const Eigen::Matrix3Xd>(theta.data() + p, 3, problem.measured.anchor_count);

  const Eigen::Index most = problem.row_count() * problem.measured.components();
  Linearization out{RowMatrixXd::Zero(most, theta.size()), Eigen::VectorXd(most), Eigen::VectorXi(most)};
  RowEvaluator evaluator(problem.model, theta.head(p));
  Eigen::Matrix<double, 6, Eigen::Dynamic> J_tool(6, p);
  RowResidual residual;
  Eigen::Index n = 0;
  for (Eigen::Index i = 0; i < problem.row_count(); ++i) {
    const Pose T = evaluator.jacobian(samples.row(i), J_tool);
    row_residual(problem.measured, i, T, &anchors, residual);
    for (int c = 0; c < kComponents; ++c) {
      if (!residual.present[static_cast<std::size_t>(c)]) continue;
      const double sigma = std::hypot(problem.measured.sigma(i, c), tau[static_cast<std::size_t>(kind_of(c))]);
      FASTCAL_CHECK(sigma > 0) << "row " << i << " has a number without a standard deviation";
      if (kind_of(c) == Kind::kPosition) {
        out.J.row(n).head(p) = J_tool.row(c) / sigma;
      } else {
        out.J.row(n).head(p) = residual.J_r_tool.row(c) * J_tool / sigma;
      }
      if (kind_of(c) == Kind::kDistance)
        out.J.row(n).segment(p + 3 * residual.anchor, 3) = residual.J_distance_anchor / sigma;
      out.r[n] = residual.r[c] / sigma;
      out.row[n++] = static_cast<int>(i);
    }
  }
  out.J.conservativeResize(n, Eigen::NoChange);
  out.r.conservativeResize(n);
  out.row.conservativeResize(n);
  return out;
}

}  // namespace fastcal
