// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/tabulated_effect.hpp"

#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {

TabulatedEffect::TabulatedEffect(std::vector<Parameter> parameters, std::vector<int> frames, int first,
                                 bool follows_loads)
    : parameters_(std::move(parameters)), frames_(std::move(frames)), first_(first), follows_loads_(follows_loads) {
  FASTCAL_CHECK(!parameters_.empty() && !frames_.empty()) << "a registered effect must have a parameter and a frame";
  for (const Parameter& parameter : parameters_)
    FASTCAL_CHECK(parameter.sigma > 0) << "parameter '" << parameter.name
                                       << "' must have a plausible size above 0, got " << parameter.sigma;
}

void TabulatedEffect::basis(const State& state, TwistColumns& columns) const {
  FASTCAL_CHECK(state.table != nullptr) << "the table of registered effects is not given";
  const double* at = state.table + first_;
  for (const int frame : frames_) {
    for (int k = 0; k < static_cast<int>(parameters_.size()); ++k, at += 6)
      columns.push_back({k, frame, Eigen::Map<const Vector6d>(at)});
  }
}

}  // namespace fastcal
