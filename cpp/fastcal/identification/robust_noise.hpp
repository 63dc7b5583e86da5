// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The noise common to all rows at the present parameters, and what is reported of it. The scales themselves are in
// noise_scale.hpp.
#pragma once

#include "fastcal/identification/fit_state.hpp"

namespace fastcal {

enum class NoiseRule {
  kMedian,  ///< of the rows' lengths
  kMean,    ///< the M-scale
  kKept     ///< root mean square of the rows that are kept
};

/// Noise common to all rows, by observation, for the residuals at theta.
CommonNoise noise(FitState& fit, NoiseRule rule, LossKind loss);

/// Largest relative change of an observation's noise.
double largest_change(const CommonNoise& a, const CommonNoise& b);

/// Numbers that the fit uses up: the free parameters, less what their priors give, |J R^-1|^2 with R^T R = J^T J +
/// priors.
double effective_parameters(FitState& fit);

/// The same by what a fit has at hand, A = J^T W J of the scaled free parameters at about this theta and noise: W the
/// weights of the loss, so a little less.
double effective_parameters(const FitState& fit, const Eigen::MatrixXd& A);

/// Brings fit.freedom up to date with so many effective parameters.
void count_freedom(FitState& fit, double effective);

/// Keeps the rows that the noise explains, or all of them; measured_count and freedom follow.
void keep_rows(FitState& fit, std::vector<bool> kept);

/// Rows that the noise at theta explains; a row without a measured number is one of them.
std::vector<bool> explained_rows(FitState& fit);

/// May outliers be looked for? Where most of the numbers go into the parameters, a fit can bend to any row, and rows
/// can be thrown out until the rest fits exactly.
bool shows_outliers(const FitState& fit);

/// Fills tau, sigma, variance_factor and outliers of `out` from what is left of the rows. The factor is what all
/// variances must be multiplied by for the squares of the rows that are kept to be what they should: below 1 only where
/// the rows claim more noise than there is.
void report_noise(FitState& fit, const RowErrors& errors, Identification& out);

}  // namespace fastcal
