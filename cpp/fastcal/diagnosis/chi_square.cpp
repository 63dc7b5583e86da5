// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/diagnosis/chi_square.hpp"

#include <cmath>

#include "fastcal/math/check.hpp"

namespace fastcal {

double chi_square_tail(double x, int k) {
  FASTCAL_CHECK(k >= 1 && x >= 0) << "chi square needs k >= 1 and x >= 0, got k = " << k << ", x = " << x;
  const double half = x / 2;
  const bool odd = k % 2 == 1;
  double sum = odd ? std::erfc(std::sqrt(half)) : 0;
  // exp(-x/2) (x/2)^s / Gamma(s + 1) for s = 0, 1, ... (even k) or 1/2, 3/2, ... (odd k), all s < k/2.
  double s = odd ? 0.5 : 0;
  double log_term = odd ? -half + 0.5 * std::log(half) - std::lgamma(1.5) : -half;
  for (; s < 0.5 * k - 0.25; s += 1) {
    sum += std::exp(log_term);
    log_term += std::log(half / (s + 1));
  }
  return sum;
}

}  // namespace fastcal
