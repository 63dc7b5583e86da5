// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Which of the asked parameters are free at the present theta; the choice itself is in identifiability.hpp.
#pragma once

#include "fastcal/identification/fit_state.hpp"

namespace fastcal {

/// What the gauge is chosen by: the triangular factor of the asked parameters on the unbent arm, priors included.
Eigen::MatrixXd gauge_factor(FitState& fit);

/// FitState::confirms_gauge() where gauge_factor() is taken.
bool confirms_gauge(FitState& fit);

/// Finds along which directions the loads' own change counts, from here on.
void follow_loads(FitState& fit);

/// The gauge at theta, and theta moved along the null directions so that the held parameters come back to where they
/// started; more are held where its new loads show fewer.
void choose_free(FitState& fit);

/// Fills asked, held, held_directions, rank and unidentifiable of `out`.
void report_gauge(FitState& fit, Identification& out);

}  // namespace fastcal
