// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/candidates.hpp"

namespace fastcal::design {

Candidates::Candidates(Eigen::Index count, int rows, Eigen::Index columns)
    : count_(count),
      rows_(rows),
      columns_(columns),
      values_(static_cast<std::size_t>(blocks() * rows * columns * kLanes), 0.0) {}

Candidates::Candidates(const Eigen::Ref<const RowMatrixXd>& J, int rows)
    : Candidates(rows > 0 ? J.rows() / rows : 0, rows, J.cols()) {
  FASTCAL_CHECK(rows >= 1 && rows <= kMostRows) << "a candidate has 1 to " << kMostRows << " rows, got " << rows;
  FASTCAL_CHECK(J.rows() > 0 && J.rows() % rows == 0 && J.cols() > 0)
      << "the rows of candidates must be a multiple of " << rows << ", and there must be columns; got (" << J.rows()
      << ", " << J.cols() << ")";
  FASTCAL_CHECK(J.allFinite()) << "the rows of candidates must be finite";
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    for (Eigen::Index j = 0; j < columns_; ++j) at(i / rows, static_cast<int>(i % rows), j) = J(i, j);
  }
}

Eigen::MatrixXd Candidates::block(Eigen::Index candidate) const {
  Eigen::MatrixXd J(rows_, columns_);
  for (int row = 0; row < rows_; ++row) {
    for (Eigen::Index j = 0; j < columns_; ++j) J(row, j) = at(candidate, row, j);
  }
  return J;
}

Candidates Candidates::subset(const std::vector<Eigen::Index>& chosen) const {
  Candidates out(static_cast<Eigen::Index>(chosen.size()), rows_, columns_);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (int row = 0; row < rows_; ++row) {
      for (Eigen::Index j = 0; j < columns_; ++j) {
        out.at(static_cast<Eigen::Index>(i), row, j) = at(chosen[i], row, j);
      }
    }
  }
  return out;
}

Eigen::MatrixXd Candidates::information(const std::vector<Eigen::Index>& chosen) const {
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(columns_, columns_);
  for (const Eigen::Index candidate : chosen) {
    M.selfadjointView<Eigen::Lower>().rankUpdate(block(candidate).transpose());
  }
  return M.selfadjointView<Eigen::Lower>();
}

}  // namespace fastcal::design
