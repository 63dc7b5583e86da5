// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Temperature that reaches the metal late:  lag dT_f/dt = T - T_f.  The filter looks at all rows in their order of
// time, so whoever makes the samples computes it; an effect with the option `lag` above 0 [s] reads the column `index`
// of State::extra in place of State::temperature.
#pragma once

#include <cmath>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {

/// The column of the filtered temperature; -1: the temperature as it was read.
inline int lagged_column(const std::string& effect, const Options& options) {
  const double lag = number_option(options, "lag", 0);
  FASTCAL_CHECK(lag >= 0 && std::isfinite(lag)) << effect << ": lag must be at least 0 s, got " << lag;
  if (lag == 0) return -1;
  const double index = number_option(options, "index", -1);
  FASTCAL_CHECK(index >= 0) << effect << ": lag needs index, the column of the filtered temperature";
  return static_cast<int>(index);
}

inline double temperature_of(const State& state, int lagged) {
  if (lagged < 0) return state.temperature;
  FASTCAL_CHECK(state.extra != nullptr) << "the filtered temperature is not given";
  return state.extra[lagged];
}

}  // namespace fastcal
