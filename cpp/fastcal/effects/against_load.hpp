// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// `sign: against`, the form of a deflection against its load. No joint and no link does that; a controller leaves it
// that compensates for deflection already, with a softer arm or a heavier load than there is.
#pragma once

#include <string>

#include "fastcal/effects/owners.hpp"

namespace fastcal {

inline constexpr char kSignOption[] = "sign";
inline constexpr char kAgainstLoad[] = "sign=against";

/// -1 with `sign: against`, else 1; throws InvalidInput where it is another word than `against` or `along`.
inline double sign_option(const std::string& effect, const Options& options) {
  const std::string sign = text_option(options, kSignOption, "along");
  FASTCAL_CHECK(sign == "along" || sign == "against") << effect << ": sign must be along or against, got " << sign;
  return sign == "against" ? -1 : 1;
}

}  // namespace fastcal
