// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// BFGS on the mean of a cost, the PMC paper's way to identify.
#pragma once

#include "fastcal/identification/reduced_problem.hpp"

namespace fastcal {

/// Minimizes from x the root of the mean squared whitened distance of `rows` rows, or with `of_distance` the mean
/// distance.
void solve_bfgs(const Reduced& reduced, double rows, bool of_distance, int max_iterations, Eigen::VectorXd& x,
                Solution& out);

}  // namespace fastcal
