// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#pragma once

namespace fastcal {

/// P(chi2_k > x) for k >= 1 degrees of freedom, x >= 0, by the finite sums of a whole k (Abramowitz and Stegun, 26.4.4
/// and 26.4.5); relative error below 1e-12 down to the smallest double, 0 beyond.
double chi_square_tail(double x, int k);

}  // namespace fastcal
