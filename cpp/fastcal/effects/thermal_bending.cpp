// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Thermal bending: one side of a link warms before the other, as in the sun or beside a motor, and the link bends
// evenly along its length l. Its far end turns by
//   theta = turn (T - T_late),
// and moves by half of theta x l. T_late is the temperature behind a first-order filter of `lag` [s], lagged.hpp: the
// two sides are alike again once the heat is through. Without a lag it is the option t0 [K]. Source: W. C. Young,
// "Roark's Formulas for Stress and Strain" (1989), temperature differentials of beams.
#include "fastcal/effects/growth.hpp"
#include "fastcal/effects/lagged.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ThermalBending : public LinearEffect {
 public:
  ThermalBending(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(link_frame(owner_index("thermal_bending", "link", owner, robot.joint_count()))),
        t0_(number_option(options, "t0", 293.15)),
        lagged_(lagged_column("thermal_bending", options)) {
    check_options("thermal_bending", options, {"t0", "lag", "index"});
    for (int axis = 3; axis < 6; ++axis) {
      parameters_.push_back({owner, std::string("turn_") + kAxes[axis], "rad_k", 1e-5,
                             "turn of the link's far end per kelvin between its sides"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"temperature"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double between = state.temperature - (lagged_ < 0 ? t0_ : temperature_of(state, lagged_));
    const Eigen::Vector3d length = growth(state, frame_).head<3>();
    for (int k = 0; k < 3; ++k) {
      Vector6d xi = Vector6d::Zero();
      xi[3 + k] = between;
      xi.head<3>() = 0.5 * between * Eigen::Vector3d::Unit(k).cross(length);
      columns.push_back({k, frame_, xi});
    }
  }

 private:
  int frame_;
  double t0_;
  int lagged_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("thermal_bending", {make<ThermalBending>,
                                            link_owners,
                                            {.phrase = "a link that bends while heat goes through it",
                                             .role = Role::kScanned,
                                             .place = Place::kLink,
                                             .depends_on = {"temperature_c", "time_s"},
                                             .needs_data = "temperature_c that varies",
                                             .shown_by = "poses that are measured while it warms and when it is warm",
                                             .plotted_over = "temperature_c",
                                             .options_from_data = {"t0_c"},
                                             .among_parameters = {"lag_s"},
                                             .searched = "lag_s"}})

}  // namespace fastcal
