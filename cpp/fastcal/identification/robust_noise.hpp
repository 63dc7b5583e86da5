// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The noise common to all rows at the present parameters, and what is reported of it. The scales themselves are in
// noise_scale.hpp.
#pragma once

#include <array>

#include "fastcal/identification/fit_state.hpp"

namespace fastcal {

enum class NoiseRule { kMedian, kMean, kClean };

/// Noise common to all rows, by kind, for the residuals at theta.
CommonNoise noise(FitState& fit, NoiseRule rule, LossKind loss);

/// Largest relative change of a kind's noise.
double largest_change(const CommonNoise& a, const CommonNoise& b);

/// How many numbers of each kind were measured; residuals (N, 7), NaN where not measured.
std::array<Eigen::Index, kKinds> counts(const RowMatrixXd& residuals);

/// Numbers that the fit uses up: the free parameters, less what their priors give, |J R^-1|^2 with R^T R = J^T J +
/// priors.
double effective_parameters(FitState& fit);

/// Brings fit.freedom up to date.
void count_freedom(FitState& fit);

/// Fills tau, sigma and variance_factor of `out` from its residuals and weights. The factor is what all variances must
/// be multiplied by for the weighted squares to be what they should: below 1 only where the rows claim more noise than
/// there is.
void report_noise(const FitState& fit, Identification& out);

}  // namespace fastcal
