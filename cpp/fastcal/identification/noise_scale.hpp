// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How large the noise common to all rows is, from what a fit leaves, which rows that noise cannot explain, and what
// a robust loss costs in certainty. Noise, floor and guess are standard deviations [m or rad].
#pragma once

#include "fastcal/identification/row_errors.hpp"

namespace fastcal {

/// Robust first guess: the noise at which half of the rows lie inside the median of the normal law (Wilson and
/// Hilferty's form of it).
double median_noise(const ObservedRows& rows, double floor, double guess);

/// M-scale: the noise at which the mean of rho is what the normal law makes it; fitting shrinks squared residuals by
/// `freedom`. rho is Tukey's, bounded: outliers cannot blow it up, and where a tenth of the rows and more disagree it
/// grows and takes them in instead of dropping them. Loss none: the plain variance.
double mean_noise(const ObservedRows& rows, LossKind loss, double freedom, double floor, double guess);

/// The whitened square u^2 beyond which a row of `components` numbers is an outlier: chi-squared so large in one of a
/// hundred sets of `rows` such rows; of very many numbers by their mean square (loss.hpp).
double outlier_limit(int components, double rows);

/// Variance of the M-estimate over that of least squares with unit noise on the same rows: K^2 B / A^2 with A = mean
/// psi', B = mean psi^2 over all numbers (R. Maronna, D. Martin, V. Yohai 2006, 5.6; psi' of a row is w I + (u w') u
/// u^T / u^2), K = 1 + (p / n) var psi' / A^2 for samples that are not large (P. Huber, E. Ronchetti, "Robust
/// Statistics" 2009, 7.6). Fitting shrinks residuals by the root of the freedom (n - p) / n, so psi is taken at what
/// they were before. The distance's psi' has a pole at 0: its mean is taken as that of psi u, the same at the normal
/// law (C. Stein 1981), and K as 1.
class VarianceInflation {
 public:
  VarianceInflation(LossKind loss, double freedom) : loss_(loss), freedom_(freedom) {}
  void add(const RowWeight& row);
  void add(const VarianceInflation& others);
  double value() const;

 private:
  LossKind loss_;
  double freedom_;
  double slope_ = 0, slope_squared_ = 0, psi_squared_ = 0, numbers_ = 0;
};

}  // namespace fastcal
