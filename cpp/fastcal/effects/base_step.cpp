// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Base step: the base, or the instrument, was knocked once,  xi = step for t >= at,  at the option `at` [s].
// Three shifts along the measuring frame's axes and three turns about them, through the base's origin.
#include <limits>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class BaseStep : public LinearEffect {
 public:
  BaseStep(const RobotModel&, const std::string& owner, const Options& options)
      : at_(number_option(options, "at", std::numeric_limits<double>::infinity())) {
    check_owner("base_step", owner, "base");
    check_options("base_step", options, {"at"});
    for (int axis = 0; axis < 6; ++axis) {
      parameters_.push_back({owner, std::string("step_") + kAxes[axis], axis < 3 ? "m" : "rad", 1e-4,
                             "motion of the base in the measuring frame at that moment"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"time"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    if (!(state.time >= at_)) return;
    for (int axis = 0; axis < 6; ++axis) columns.push_back({axis, kBaseFrame, base_motion(state, axis, 1)});
  }

 private:
  double at_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("base_step", {make<BaseStep>,
                                      single_owner("base"),
                                      {.phrase = "a step of the base or the instrument",
                                       .place = Place::kBase,
                                       .depends_on = {"time_s"},
                                       .needs_data = "time_s over which the set-up may move",
                                       .shown_by = "poses that are measured again later",
                                       .refers_to = Reference::kBase,
                                       .of_the_measurement = true,
                                       .plotted_over = "time_s",
                                       .among_parameters = {"at_s"},
                                       .searched = "at_s"}})

}  // namespace fastcal
