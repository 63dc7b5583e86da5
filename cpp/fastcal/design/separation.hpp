// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Which candidates separate one cause of error from another (T-optimality: A. Atkinson, V. Fedorov, "The design of
// experiments for discriminating between two rival models", Biometrika 62, 1975). Cause i is there, b_i of it; a model
// with the common columns A and those of cause j is fitted. What is left of it,
//   D_ij = |P C_i b_i|^2,  P the projection across [A, C_j],
// is the noncentrality of the test that would refuse j (separation_scan.hpp keeps it up to date, exactly).
#pragma once

#include "fastcal/design/candidates.hpp"

namespace fastcal::design {

struct SeparationProblem {
  RowMatrixXd common;                     ///< (N k, p) columns of what is identified in any case, whitened
  std::vector<RowMatrixXd> causes;        ///< (N k, c_i) columns of each cause
  std::vector<Eigen::MatrixXd> expected;  ///< (c_i, e_i) how much of each there may be: squares of the columns add up
  int rows = 3;                           ///< k
  Eigen::MatrixXd prior;  ///< information of earlier data on [common, causes ...], or empty: nothing was measured yet
};

struct Separation {
  std::vector<Eigen::Index> chosen;  ///< in the order in which they were added
  Eigen::MatrixXd before, after;     ///< (m, m) D_ij; the diagonal is 0
};

/// Adds up to `count` candidates, each at most once, the one that most raises sum over i != j of log(1 + D_ij) first;
/// stops where every D_ij is at least `enough`. Before anything was measured the first ones are those that fix most of
/// the parameters, for as many as could be determined exactly. Ties go to the candidate that comes first.
Separation separate(const SeparationProblem& problem, int count, double enough, int threads);

}  // namespace fastcal::design
