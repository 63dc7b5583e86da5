// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What separates cause i from cause j (separation.hpp), D_ij = |P u|^2 with u = C_i b_i and P the projection across X =
// [A, C_j]. With beta the fit of u and e_c = u_c - X_c beta, adding candidate c gains exactly e_c^T (I + S_c)^-1 e_c
// (recursive least squares): nothing about it is approximate.
#pragma once

#include "fastcal/design/scan.hpp"

namespace fastcal::design {

/// D of one pair; candidates are the rows of X = [A, C_j].
class SeparationScan : public Scan {
 public:
  /// `u` (N k, e): what the fit should not explain, squares of several columns add up. `H` (p + e, p + e): what earlier
  /// data hold of [X u], or empty.
  SeparationScan(const Candidates& candidates, RowMatrixXd u, Eigen::MatrixXd H, int threads);
  double value() const override { return value_; }
  Eigen::VectorXd sensitivities() const override;
  std::unique_ptr<Scan> over(const Candidates& candidates) const override;

 protected:
  void restart_goal(const Eigen::MatrixXd& M) override;
  Eigen::MatrixXd prepare(Eigen::Index candidate, const Eigen::MatrixXd& U, const Small& L_inverse,
                          double sign) override;
  void change_block(Eigen::Index block, const Lane* X, int columns, double sign) override;
  double gain(Eigen::Index candidate, const Small& S, double sign) const override;

 private:
  Eigen::MatrixXd residual(Eigen::Index candidate) const;

  RowMatrixXd u_;
  Eigen::MatrixXd H_;
  int width_;  // e
  double value_ = 0;
  Eigen::MatrixXd z_;      // (k, e) L^-1 e_c of the change that is being made
  std::vector<double> E_;  // (blocks, k, e, lanes)
};

}  // namespace fastcal::design
