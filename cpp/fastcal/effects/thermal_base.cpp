// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Thermal base: the base, or the instrument's stand, moves with the temperature,  xi = rate (T - T0),  T0 the option t0
// [K]. Heat that lags: T is the temperature behind a first-order filter of `lag` [s], lagged.hpp. Three rates along the
// measuring frame's axes and three about them, through the base's origin.
#include "fastcal/effects/lagged.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ThermalBase : public LinearEffect {
 public:
  ThermalBase(const RobotModel&, const std::string& owner, const Options& options)
      : t0_(number_option(options, "t0", 293.15)), lagged_(lagged_column("thermal_base", options)) {
    check_owner("thermal_base", owner, "base");
    check_options("thermal_base", options, {"t0", "lag", "index"});
    for (int axis = 0; axis < 6; ++axis) {
      const bool turns = axis >= 3;
      parameters_.push_back({owner, std::string("rate_") + kAxes[axis], turns ? "rad_k" : "m_k", 1e-5,
                             "motion of the base in the measuring frame per kelvin"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"temperature"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double warmer = temperature_of(state, lagged_) - t0_;
    for (int axis = 0; axis < 6; ++axis) columns.push_back({axis, kBaseFrame, base_motion(state, axis, warmer)});
  }

 private:
  double t0_;
  int lagged_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("thermal_base", {make<ThermalBase>,
                                         single_owner("base"),
                                         {.phrase = "a motion of the base or the instrument by temperature",
                                          .role = Role::kScanned,
                                          .place = Place::kBase,
                                          .depends_on = {"temperature_c"},
                                          .needs_data = "temperature_c that varies",
                                          .shown_by = "poses that are measured cold and warm",
                                          .refers_to = Reference::kBase,
                                          .of_the_measurement = true,
                                          .plotted_over = "temperature_c",
                                          .options_from_data = {"t0_c"},
                                          .among_parameters = {"lag_s"},
                                          .searched = "lag_s"}})

}  // namespace fastcal
