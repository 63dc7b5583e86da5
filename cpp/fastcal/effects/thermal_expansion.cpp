// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Thermal expansion: the lengths of one link, or of all from base to flange, grow by the factor 1 + coefficient (T -
// T0),  T0 the option t0 [K]. Heat that lags: T is the temperature behind a
// first-order filter of `lag` [s], lagged.hpp. A link's lengths are the translation C_f.p of the constant part of its
// frame: a and d of a DH row, the way to the next origin of a URDF.
//   T_(f-1) C_f Z_f exp(xi),  xi = coefficient (T - T0) (R_C R_Z)^T C_f.p    leaves joints, base and tool where they
//   are.
#include "fastcal/effects/growth.hpp"
#include "fastcal/effects/lagged.hpp"
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

std::vector<std::string> arm_and_links(const RobotModel& robot) {
  std::vector<std::string> out = link_owners(robot);
  out.insert(out.begin(), "robot");
  return out;
}

class ThermalExpansion : public LinearEffect {
 public:
  ThermalExpansion(const RobotModel& robot, const std::string& owner, const Options& options)
      : t0_(number_option(options, "t0", 293.15)),
        lagged_(lagged_column("thermal_expansion", options)),
        parameters_{{owner, "coefficient", "1_k", 1e-5, "relative growth of the lengths per kelvin"}} {
    check_options("thermal_expansion", options, {"t0", "lag", "index"});
    if (owner != "robot") {
      frames_ = {link_frame(owner_index("thermal_expansion", "link", owner, robot.joint_count()))};
      return;
    }
    for (int f = kBaseFrame + 1; f < tool_frame(robot.joint_count()); ++f) frames_.push_back(f);
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"temperature"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    for (const int f : frames_) {
      const Vector6d unit = growth(state, f);
      if (!unit.isZero(0)) columns.push_back({0, f, (temperature_of(state, lagged_) - t0_) * unit});
    }
  }

 private:
  double t0_;
  int lagged_;
  std::vector<int> frames_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("thermal_expansion", {make<ThermalExpansion>,
                                              arm_and_links,
                                              {.phrase = "thermal growth",
                                               .place = Place::kLink,
                                               .depends_on = {"temperature_c"},
                                               .needs_data = "temperature_c that varies",
                                               .shown_by = "poses that are measured cold and warm",
                                               .plotted_over = "temperature_c",
                                               .options_from_data = {"t0_c"},
                                               .among_parameters = {"lag_s"}}})

}  // namespace fastcal
