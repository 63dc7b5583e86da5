// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The arm of scene.hpp with its reduction ratios, written with Ceres and independent of fastcal: a chain of turns about
// and shifts along own axes.
#pragma once

#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal::bench {

enum class Derivatives {
  kFrames,     ///< automatic; each row of the table is a frame, R <- R A, p <- p + R a, as textbooks write it
  kPoints,     ///< automatic; the tool's point is carried back to the base, a third of the products
  kWrittenOut  ///< of the same chain, by hand
};

/// Least squares of points p (N, 3) over the parameters `free` (base, rows of theta d a alpha beta, the tool's pose,
/// reduction ratios: in fastcal's order), from the nominal arm; the RMS of what is left [m].
double solve_with_ceres(const RowMatrixXd& q, const RowMatrixXd& p, const std::vector<int>& free,
                        Derivatives derivatives);

}  // namespace fastcal::bench
