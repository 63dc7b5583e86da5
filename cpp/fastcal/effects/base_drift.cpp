// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Base drift: the base moves steadily in the measuring frame (or the instrument in the hall),  xi = rate (t - t0),  t0
// the option t0 [s], from the time `first` to the time `last` [s] of the data; before and after it stands still, since
// nobody has measured whether it goes on. Three rates along the measuring frame's axes and three about them, through
// the base's origin.
#include <algorithm>
#include <limits>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class BaseDrift : public LinearEffect {
 public:
  BaseDrift(const RobotModel&, const std::string& owner, const Options& options)
      : t0_(number_option(options, "t0", 0)),
        first_(number_option(options, "first", -std::numeric_limits<double>::infinity())),
        last_(number_option(options, "last", std::numeric_limits<double>::infinity())) {
    check_owner("base_drift", owner, "base");
    check_options("base_drift", options, {"t0", "first", "last"});
    FASTCAL_CHECK(first_ <= last_) << "base_drift: first must not be after last, got " << first_ << " and " << last_;
    for (int axis = 0; axis < 6; ++axis) {
      const bool turns = axis >= 3;
      parameters_.push_back({owner, std::string("rate_") + kAxes[axis], turns ? "rad_s" : "m_s", turns ? 1e-8 : 2e-8,
                             "speed of the base in the measuring frame"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"time"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double elapsed = std::clamp(state.time, first_, last_) - t0_;
    for (int axis = 0; axis < 6; ++axis) columns.push_back({axis, kBaseFrame, base_motion(state, axis, elapsed)});
  }

 private:
  double t0_, first_, last_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("base_drift", {make<BaseDrift>,
                                       single_owner("base"),
                                       {.phrase = "a drift of the base or the instrument in time",
                                        .place = Place::kBase,
                                        .depends_on = {"time_s"},
                                        .needs_data = "time_s over which the set-up may move",
                                        .shown_by = "poses that are measured again later",
                                        .refers_to = Reference::kBase,
                                        .of_the_measurement = true,
                                        .plotted_over = "time_s",
                                        .options_from_data = {"t0_s", "times"}}})

}  // namespace fastcal
