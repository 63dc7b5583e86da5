// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Base settling: the base, or the instrument's stand, comes to rest,
//   xi = way (1 - exp(-(t - begins) / tau)),
// from the time `begins` [s] on, with the time constant tau [s]; before, it stands still. Three numbers along the
// measuring frame's axes and three about them, through the base's origin. With a long tau it is a drift.
#include <algorithm>
#include <cmath>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class BaseSettling : public LinearEffect {
 public:
  BaseSettling(const RobotModel&, const std::string& owner, const Options& options)
      : begins_(number_option(options, "begins", 0)), tau_(number_option(options, "tau", 0)) {
    check_owner("base_settling", owner, "base");
    check_options("base_settling", options, {"begins", "tau"});
    FASTCAL_CHECK(tau_ > 0 && std::isfinite(tau_))
        << "base_settling needs tau_s, its time constant, above 0; a diagnosis finds it";
    for (int axis = 0; axis < 6; ++axis) {
      parameters_.push_back({owner, std::string("way_") + kAxes[axis], axis < 3 ? "m" : "rad", 1e-4,
                             "motion of the base in the measuring frame until it is at rest"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"time"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double done = 1 - std::exp(-std::max(state.time - begins_, 0.0) / tau_);
    for (int axis = 0; axis < 6; ++axis) columns.push_back({axis, kBaseFrame, base_motion(state, axis, done)});
  }

 private:
  double begins_, tau_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("base_settling", {make<BaseSettling>,
                                          single_owner("base"),
                                          {.phrase = "a base or an instrument that comes to rest",
                                           .role = Role::kScanned,
                                           .place = Place::kBase,
                                           .depends_on = {"time_s"},
                                           .needs_data = "time_s over which the set-up may move",
                                           .shown_by = "poses that are measured again later",
                                           .generalizes = {"base_drift"},
                                           .refers_to = Reference::kBase,
                                           .of_the_measurement = true,
                                           .plotted_over = "time_s",
                                           .options_from_data = {"begins_s"},
                                           .among_parameters = {"tau_s"},
                                           .searched = "tau_s"}})

}  // namespace fastcal
