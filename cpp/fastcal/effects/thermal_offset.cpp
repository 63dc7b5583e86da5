// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Thermal offset: a joint's zero moves with the temperature,  dq = k (T - T0),  T0 the option t0 [K]. Heat that lags: T
// is the temperature behind a first-order filter of `lag` [s], lagged.hpp.
#include "fastcal/effects/lagged.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ThermalOffset : public LinearEffect {
 public:
  ThermalOffset(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("thermal_offset", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        t0_(number_option(options, "t0", 293.15)),
        lagged_(lagged_column("thermal_offset", options)) {
    check_options("thermal_offset", options, {"t0", "lag", "index"});
    const bool turns = types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute;
    parameters_ = {{owner, "", turns ? "rad_k" : "m_k", turns ? 1e-5 : 5e-6, "shift of the joint's zero per kelvin"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  std::vector<std::string> data_columns() const override { return {"temperature"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, temperature_of(state, lagged_) - t0_)});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  double t0_;
  int lagged_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("thermal_offset", {make<ThermalOffset>,
                                           joint_owners,
                                           {.phrase = "a thermal drift of its zero",
                                            .place = Place::kJoint,
                                            .depends_on = {"temperature_c"},
                                            .needs_data = "temperature_c that varies",
                                            .shown_by = "poses that are measured cold and warm",
                                            .refers_to = Reference::kAxes,
                                            .plotted_over = "temperature_c",
                                            .options_from_data = {"t0_c"},
                                            .among_parameters = {"lag_s"},
                                            .number = "turn per kelvin"}})

}  // namespace fastcal
