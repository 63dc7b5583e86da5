// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Range wave: the instrument's lengths err in waves, as of an interferometer's fringes or a phase meter's modulation,
//   measured r' = r + sine sin(2 pi r' / period) + cosine cos(2 pi r' / period),
// r [m] from the instrument, at the origin of its measuring frame. The tool moves along its direction u,  xi = R^T u
// (r' - r). Source: J. M. Rueger, "Electronic Distance Measurement" (1990), cyclic errors.
#include <cmath>

#include "fastcal/effects/owners.hpp"
#include "fastcal/effects/sight.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr double kTurn = 6.283185307179586;

class RangeWave : public LinearEffect {
 public:
  RangeWave(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())),
        period_(number_option(options, "period", 0)),
        parameters_{{owner, "sine", "m", 1e-4, "error of a length along sin(2 pi length / period)"},
                    {owner, "cosine", "m", 1e-4, "error of a length along cos(2 pi length / period)"}} {
    check_owner("range_wave", owner, "instrument");
    check_options("range_wave", options, {"period"});
    FASTCAL_CHECK(period_ > 0 && std::isfinite(period_))
        << "range_wave needs period_mm, the length of its wave, above 0; a diagnosis finds it";
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }

  void basis(const State& state, TwistColumns& columns) const override {
    const Pose& tool = state.frames[frame_];
    const double angle = kTurn * tool.p.norm() / period_;
    columns.push_back({0, frame_, along_sight(tool, std::sin(angle))});
    columns.push_back({1, frame_, along_sight(tool, std::cos(angle))});
  }

 private:
  int frame_;
  double period_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("range_wave", {make<RangeWave>,
                                       single_owner("instrument"),
                                       {.phrase = "waves of the lengths that it measures",
                                        .role = Role::kScanned,
                                        .place = Place::kInstrument,
                                        .depends_on = {"x", "y", "z"},
                                        .shown_by = "poses at many distances from the instrument",
                                        .refers_to = Reference::kAxes,
                                        .of_the_measurement = true,
                                        .among_parameters = {"period_mm"},
                                        .searched = "period_mm"}})

}  // namespace fastcal
