// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Range step: the instrument's lengths changed once, as where its beam was broken and its distance taken anew,
//   measured r' = r + step from a moment on (moment.hpp),
// the instrument at the origin of its measuring frame. The tool moves along its direction u,  xi = R^T u step.
// Source: ASME B89.4.19-2006 (ranging tests of laser trackers).
#include "fastcal/effects/moment.hpp"
#include "fastcal/effects/owners.hpp"
#include "fastcal/effects/sight.hpp"

namespace fastcal {
namespace {

class RangeStep : public LinearEffect {
 public:
  RangeStep(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())),
        moment_("range_step", options),
        parameters_{{owner, "step", "m", 1e-4, "added to each length from that moment on"}} {
    check_owner("range_step", owner, "instrument");
    check_moment_options("range_step", options);
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, frame_, along_sight(state.frames[frame_], moment_.share(state))});
  }

 private:
  int frame_;
  Moment moment_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("range_step", {make<RangeStep>,
                                       single_owner("instrument"),
                                       {.phrase = "a jump of the lengths that it measures",
                                        .role = Role::kScanned,
                                        .place = Place::kInstrument,
                                        .depends_on = {"time_s"},
                                        .needs_data = "rows in the order in which they were measured",
                                        .shown_by = "poses that are measured again later",
                                        .refers_to = Reference::kAxes,
                                        .of_the_measurement = true,
                                        .among_parameters = {"at_s", "at_row"},
                                        .searched = "at_s"}})

}  // namespace fastcal
