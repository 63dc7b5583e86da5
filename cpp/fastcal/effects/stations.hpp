// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Errors of instruments: all stations have one, or each its own where the option `count` says how many there are.
#pragma once

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {

inline int station_count(const std::string& effect, const Options& options) {
  const double count = number_option(options, "count", 1);
  FASTCAL_CHECK(count >= 1) << effect << " needs at least one station, got " << count;
  return static_cast<int>(count);
}

/// How the parameters of a station begin: "", "station2_" ...
inline std::string station_prefix(int station) {
  return station == 0 ? "" : "station" + std::to_string(station + 1) + "_";
}

}  // namespace fastcal
