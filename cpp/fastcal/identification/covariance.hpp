// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How sure the free parameters are.
#pragma once

#include "fastcal/identification/fit_state.hpp"

namespace fastcal {

/// Root L (p, p) of the covariance of the free parameters, SI, lower triangular with a positive diagonal: L L^T = (R^T
/// R / inflation + priors)^-1 with R^T R = J^T J of all rows; what a robust loss costs in certainty is in the
/// inflation, found from the rows' `errors`.
Eigen::MatrixXd covariance_root(FitState& fit, const RowErrors& errors);

}  // namespace fastcal
