// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/thinned_problem.hpp"

#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

/// The middle of each of `count` equal parts of the rows.
std::vector<Eigen::Index> spread_rows(Eigen::Index rows, Eigen::Index count) {
  std::vector<Eigen::Index> out(static_cast<std::size_t>(count));
  for (Eigen::Index k = 0; k < count; ++k) out[static_cast<std::size_t>(k)] = (2 * k + 1) * rows / (2 * count);
  return out;
}

SomeRows picked(const Problem& whole, const std::vector<Eigen::Index>& rows) {
  if (whole.source != nullptr) return whole.source->pick(rows);
  return {std::make_shared<const Samples>(whole.samples.pick(rows)),
          std::make_shared<const Measurements>(whole.measured.pick(rows))};
}

}  // namespace

ThinnedProblem::ThinnedProblem(const Problem& whole, Eigen::Index count)
    : ThinnedProblem(whole, spread_rows(whole.row_count(), count)) {}

ThinnedProblem::ThinnedProblem(const Problem& whole, const std::vector<Eigen::Index>& rows)
    : model_(whole.model), rows_(picked(whole, rows)), threads_(whole.threads) {}

bool represents(const Eigen::MatrixXd& R_thinned, const Eigen::MatrixXd& R_whole, double share) {
  constexpr double kRepresented = 0.1;  // of the rows' share
  // |R_thinned x|^2 >= kRepresented share |R_whole x|^2 for every x.
  const Eigen::MatrixXd ratio = divided_by_lower(R_thinned, R_whole).transpose();
  if (!ratio.allFinite()) return false;
  const Eigen::VectorXd values = right_svd(ratio).values;
  return values.size() == 0 || values.minCoeff() * values.minCoeff() >= kRepresented * share;
}

}  // namespace fastcal
