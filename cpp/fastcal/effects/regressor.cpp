// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Regressor: a column of the user's own moves a frame,  xi = coefficient c,  c the number in the column (a tilt sensor,
// a pressure, a count). Options: `column` its name, `index` its place in State::extra, `axis` one of x, y, z, rx, ry,
// rz of the frame, or all six where it is not given; `size` the root mean square of the column where it is first
// fitted, so that the plausible size of the motion is the same whatever the column's unit.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class Regressor : public LinearEffect {
 public:
  Regressor(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(frame_index("regressor", owner, robot)),
        column_(text_option(options, "column", "")),
        index_(static_cast<int>(number_option(options, "index", 0))) {
    check_options("regressor", options, {"column", "index", "axis", "size"});
    const double size = number_option(options, "size", 1);
    FASTCAL_CHECK(size > 0 && std::isfinite(size)) << "regressor: size must be positive, got " << size;
    FASTCAL_CHECK(!column_.empty()) << "regressor needs the option column, the name of a column of numbers in the data";
    FASTCAL_CHECK(index_ >= 0) << "regressor: index must not be negative, got " << index_;
    const std::string axis = text_option(options, "axis", "all");
    FASTCAL_CHECK(axis == "all" || std::find(std::begin(kAxes), std::end(kAxes), axis) != std::end(kAxes))
        << "regressor: axis must be x, y, z, rx, ry, rz or all, got '" << axis << "'";
    for (int k = 0; k < 6; ++k) {
      if (axis != "all" && axis != kAxes[k]) continue;
      axes_.push_back(k);
      parameters_.push_back({owner, column_ + "_" + kAxes[k], k < 3 ? "m" : "rad", 1e-4 / size,
                             "motion of the frame per unit of the column"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  std::vector<std::string> data_columns() const override { return {"extra:" + column_}; }

  void basis(const State& state, TwistColumns& columns) const override {
    FASTCAL_CHECK(state.extra != nullptr) << "regressor needs the column " << column_ << ", which is not given";
    for (std::size_t k = 0; k < axes_.size(); ++k)
      columns.push_back({static_cast<int>(k), frame_, state.extra[index_] * Vector6d::Unit(axes_[k])});
  }

 private:
  int frame_;
  std::string column_;
  int index_;
  std::vector<int> axes_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("regressor", {make<Regressor>,
                                      frame_owners,
                                      {.phrase = "a motion that follows a column of the data",
                                       .role = Role::kCurve,
                                       .place = Place::kFrame,
                                       .depends_on = {"extra"},
                                       .needs_data = "the column that it names",
                                       .shown_by = "varying numbers in the column that it refers to",
                                       .options_from_data = {"size"}}})

}  // namespace fastcal
