// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The first stage of an identification: a start near the solution, whatever the data cannot determine.
#pragma once

#include "fastcal/identification/fit_state.hpp"

namespace fastcal {

/// So many rows and more are identified on some of them first.
inline constexpr Eigen::Index kThinFrom = 10'000;
inline constexpr Eigen::Index kThinnedRows = 4096;

/// Every k-th row of a problem, about 4,000: where a fit to all of them begins within a few standard deviations.
class ThinnedProblem {
 public:
  explicit ThinnedProblem(const Problem& whole);
  ThinnedProblem(const ThinnedProblem&) = delete;
  ThinnedProblem& operator=(const ThinnedProblem&) = delete;

  Problem problem() const { return {model_, samples_, measured_, threads_}; }

 private:
  ThinnedProblem(const Problem& whole, const std::vector<Eigen::Index>& rows);

  const ErrorModel& model_;
  Samples samples_;
  Measurements measured_;
  int threads_;
};

/// Do the rows that a thinned problem kept show each direction that all rows show? Factors of the whitened Jacobians of
/// the same parameters.
bool represents(const Eigen::MatrixXd& R_thinned, const Eigen::MatrixXd& R_whole, double share);

/// Moves all asked parameters under weak priors (30 plausible sizes) and Huber's loss, and finds a first noise.
void coarse_fit(FitState& fit);

}  // namespace fastcal
