// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/covariance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/noise_scale.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {

Eigen::MatrixXd covariance_root(FitState& fit, const RowErrors& errors) {
  const auto p = static_cast<Eigen::Index>(fit.free.size());
  if (p == 0) return {};
  Eigen::MatrixXd R = fit.free_factor();
  // Rows that measure nothing carry no information and are not in R; rows with weight 0 are in it, and the inflation
  // counts them out.
  if (fit.options.noise.empty()) {
    const bool mean_distance = fit.options.solver.method == Method::kBfgsMeanDistance;
    const VarianceInflation nothing(mean_distance ? LossKind::kDistance : fit.loss, fit.freedom);
    VarianceInflation inflation = nothing;
    errors.sum_rows(
        nothing, [&](VarianceInflation& sums, Eigen::Index i) { sums.add(errors.whitened(i, fit.tau)); },
        [&](const VarianceInflation& sums) { inflation.add(sums); });
    R /= std::sqrt(std::max(inflation.value(), std::numeric_limits<double>::min()));
  }
  R = with_priors(R, fit.free, fit.free_scale, fit.options.limits);
  // No digit is lost to a square, as in a Cholesky factor of the covariance.
  Eigen::MatrixXd L = fit.free_scale.asDiagonal() * inverse_of_lower(R);
  for (Eigen::Index k = 0; k < p; ++k) {
    if (L(k, k) < 0) L.col(k) *= -1;
  }
  return L;
}

}  // namespace fastcal
