// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The first stage of an identification: a start near the solution, whatever the data cannot determine.
#pragma once

#include "fastcal/identification/fit_state.hpp"

namespace fastcal {

/// Moves all asked parameters under weak priors (30 plausible sizes) and Huber's loss, and finds a first noise. Has it
/// come to the minimum, within a standard deviation?
bool coarse_fit(FitState& fit);

}  // namespace fastcal
