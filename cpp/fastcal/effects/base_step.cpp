// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Base step: the base, or the instrument, was knocked once,  xi = step from a moment on (moment.hpp).
// Three shifts along the measuring frame's axes and three turns about them, through the base's origin.
#include "fastcal/effects/moment.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class BaseStep : public LinearEffect {
 public:
  BaseStep(const RobotModel&, const std::string& owner, const Options& options)
      : moment_("base_step", options), by_row_(options.count("at_row") > 0) {
    check_owner("base_step", owner, "base");
    check_moment_options("base_step", options);
    for (int axis = 0; axis < 6; ++axis) {
      parameters_.push_back({owner, std::string("step_") + kAxes[axis], axis < 3 ? "m" : "rad", 1e-4,
                             "motion of the base in the measuring frame at that moment"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override {
    return by_row_ ? std::vector<std::string>{} : std::vector<std::string>{"time"};
  }

  void basis(const State& state, TwistColumns& columns) const override {
    const double share = moment_.share(state);
    if (share == 0) return;
    for (int axis = 0; axis < 6; ++axis) columns.push_back({axis, kBaseFrame, base_motion(state, axis, share)});
  }

 private:
  Moment moment_;
  bool by_row_;
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
                                       .among_parameters = {"at_s", "at_row"},
                                       .searched = "at_s"}})

}  // namespace fastcal
