// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A pedestal that yields sideways: the base turns about its x by the moment M_x [N m] that the arm puts on it there,
//   phi_x = c M_x,   c in rad/(N m).
// tests/python/diagnosis/test_own_effect.py has the same effect in Python, and is run with this one in the core as
// well.
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class PedestalTilt : public LinearEffect {
 public:
  PedestalTilt(const RobotModel& /*robot*/, const std::string& owner, const Options& options)
      : parameters_{{owner, "", "rad_nm", 1e-7, "turn of the base per moment"}} {
    check_options("pedestal_tilt", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  void basis(const State& state, TwistColumns& columns) const override {
    Vector6d xi = Vector6d::Zero();
    xi[3] = state.load[6 * kBaseFrame + 3];
    columns.push_back({0, kBaseFrame, xi});
  }

 private:
  std::vector<Parameter> parameters_;
};

std::vector<std::string> the_base(const RobotModel& /*robot*/) { return {"base"}; }

}  // namespace

FASTCAL_REGISTER_EFFECT("pedestal_tilt", {make<PedestalTilt>,
                                          the_base,
                                          {.phrase = "a pedestal that yields",
                                           .place = Place::kBase,
                                           .depends_on = {"load"},
                                           .shown_by = kShownByLoads,
                                           .refers_to = Reference::kBase,
                                           .number = "turn of the base per moment"}})

}  // namespace fastcal
