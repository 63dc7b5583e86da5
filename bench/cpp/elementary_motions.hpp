// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The arm of scene.hpp with its reduction ratios, written with Ceres and independent of fastcal: a chain of turns about
// and shifts along own axes.
#pragma once

#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal::bench {

enum class Derivatives { kAutomatic, kWrittenOut };

/// Least squares of points p (N, 3) over the parameters `free` (base, rows of theta d a alpha beta, the tool's pose,
/// reduction ratios: in fastcal's order), from the nominal arm; the RMS of what is left [m].
double solve_with_ceres(const RowMatrixXd& q, const RowMatrixXd& p, const std::vector<int>& free,
                        Derivatives derivatives);

}  // namespace fastcal::bench
