// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Base drift: the base moves steadily in the measuring frame (or the instrument in the hall),  xi = rate (t - t0),  t0
// the option t0 [s]. Three rates along the measuring frame's axes and three about them, through the base's origin.
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class BaseDrift : public LinearEffect {
 public:
  BaseDrift(const RobotModel&, const std::string& owner, const Options& options)
      : t0_(number_option(options, "t0", 0)) {
    check_owner("base_drift", owner, "base");
    check_options("base_drift", options, {"t0"});
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
    for (int axis = 0; axis < 6; ++axis)
      columns.push_back({axis, kBaseFrame, base_motion(state, axis, state.time - t0_)});
  }

 private:
  double t0_;
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
                                        .options_from_data = {"t0_s"}}})

}  // namespace fastcal
