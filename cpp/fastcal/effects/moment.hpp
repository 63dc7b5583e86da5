// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// From when on something is there: for all rows measured at the option `at` [s] or later; where rows have no time, from
// the row `at_row` on, counted from 0 in the order of measuring. What a row then has of it, 0 or 1, follows from the
// order of rows, so whoever makes the samples writes it into the column `index` of State::extra. A row of unknown time
// comes after: the arm is as it was left.
#pragma once

#include <limits>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {

class Moment {
 public:
  static constexpr const char* kOptions[4] = {"at", "at_row", "rows", "index"};

  Moment(const std::string& effect, const Options& options)
      : at_(number_option(options, "at", std::numeric_limits<double>::infinity())) {
    if (options.count("at_row") == 0) return;
    FASTCAL_CHECK(options.count("at") == 0) << effect << " takes its moment from at or from at_row, and both are given";
    index_ = static_cast<int>(number_option(options, "index", -1));
    FASTCAL_CHECK(index_ >= 0) << effect << ": at_row needs index, the column of what each row has of it";
  }

  /// What a row has of it.
  double share(const State& state) const {
    if (index_ < 0) return state.time < at_ ? 0 : 1;
    FASTCAL_CHECK(state.extra != nullptr) << "the order of the rows is not given";
    return state.extra[index_];
  }

 private:
  double at_;
  int index_ = -1;
};

inline void check_moment_options(const std::string& effect, const Options& options) {
  check_options(effect, options, {std::begin(Moment::kOptions), std::end(Moment::kOptions)});
}

}  // namespace fastcal
