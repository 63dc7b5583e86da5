// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Thermal spring: what holds or drives the joint changes with the temperature by its position, as a gas spring or an
// eccentric gear does,
//   dq = (T - T0) (offset + sine sin q + cosine cos q),
// T0 the option t0 [K]. Heat that lags: T is the temperature behind a first-order filter of `lag` [s], lagged.hpp.
#include <cmath>

#include "fastcal/effects/lagged.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ThermalSpring : public LinearEffect {
 public:
  ThermalSpring(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("thermal_spring", "joint", owner, robot.joint_count())),
        t0_(number_option(options, "t0", 293.15)),
        lagged_(lagged_column("thermal_spring", options)),
        parameters_{{owner, "offset", "rad_k", 1e-5, "turn per kelvin, at every position"},
                    {owner, "sine", "rad_k", 1e-5, "turn per kelvin along sin q"},
                    {owner, "cosine", "rad_k", 1e-5, "turn per kelvin along cos q"}} {
    check_options("thermal_spring", options, {"t0", "lag", "index"});
    FASTCAL_CHECK(robot.description().joint_types[static_cast<std::size_t>(joint_)] == JointType::kRevolute)
        << "thermal_spring is for joints that turn, and " << owner << " slides";
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  std::vector<std::string> data_columns() const override { return {"temperature"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double warmer = temperature_of(state, lagged_) - t0_;
    const double q = state.q[joint_];
    const double along[3] = {1, std::sin(q), std::cos(q)};
    for (int k = 0; k < 3; ++k) {
      Vector6d xi = Vector6d::Zero();
      xi[5] = warmer * along[k];
      columns.push_back({k, joint_frame(joint_), xi});
    }
  }

 private:
  int joint_;
  double t0_;
  int lagged_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("thermal_spring", {make<ThermalSpring>,
                                           revolute_owners,
                                           {.phrase = "a turn by temperature and its position, as of a gas spring",
                                            .role = Role::kScanned,
                                            .place = Place::kJoint,
                                            .depends_on = {"temperature_c", "q{n}"},
                                            .needs_data = "temperature_c that varies",
                                            .shown_by = "poses of {owner} all over its range, cold and warm",
                                            .generalizes = {"thermal_offset"},
                                            .refers_to = Reference::kAxes,
                                            .plotted_over = "temperature_c",
                                            .options_from_data = {"t0_c"},
                                            .among_parameters = {"lag_s"},
                                            .searched = "lag_s"}})

}  // namespace fastcal
