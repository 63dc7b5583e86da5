// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Some rows that stand for all of them: where an identification begins, and what its gauge is chosen by.
#pragma once

#include <vector>

#include "fastcal/identification/problem.hpp"

namespace fastcal {

/// Some rows of a problem, spread over it.
class ThinnedProblem {
 public:
  ThinnedProblem(const Problem& whole, Eigen::Index count);
  ThinnedProblem(const ThinnedProblem&) = delete;
  ThinnedProblem& operator=(const ThinnedProblem&) = delete;

  Problem problem() const { return {model_, *rows_.samples, *rows_.measured, threads_}; }

 private:
  ThinnedProblem(const Problem& whole, const std::vector<Eigen::Index>& rows);

  const ErrorModel& model_;
  SomeRows rows_;
  int threads_;
};

/// Do the rows that a thinned problem kept show each direction that all rows show? Factors of the whitened Jacobians of
/// the same parameters.
bool represents(const Eigen::MatrixXd& R_thinned, const Eigen::MatrixXd& R_whole, double share);

}  // namespace fastcal
