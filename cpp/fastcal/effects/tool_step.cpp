// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Tool step: the tool or the target slipped once,  xi = step from a moment on (moment.hpp), along and about the tool's
// own axes.
#include "fastcal/effects/moment.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ToolStep : public LinearEffect {
 public:
  ToolStep(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())), moment_("tool_step", options) {
    check_owner("tool_step", owner, "tool");
    check_moment_options("tool_step", options);
    for (int axis = 0; axis < 6; ++axis) {
      parameters_.push_back({owner, std::string("step_") + kAxes[axis], axis < 3 ? "m" : "rad", axis < 3 ? 1e-4 : 1e-3,
                             "motion of the tool in its own frame at that moment"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double share = moment_.share(state);
    if (share == 0) return;
    for (int axis = 0; axis < 6; ++axis) columns.push_back({axis, frame_, share * Vector6d::Unit(axis)});
  }

 private:
  int frame_;
  Moment moment_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("tool_step", {make<ToolStep>,
                                      single_owner("tool"),
                                      {.phrase = "a slip of the tool or the target",
                                       .role = Role::kScanned,
                                       .place = Place::kTool,
                                       .depends_on = {"time_s"},
                                       .needs_data = "rows in the order in which they were measured",
                                       .shown_by = "poses that are measured again later",
                                       .refers_to = Reference::kFlange,
                                       .of_the_measurement = true,
                                       .among_parameters = {"at_s", "at_row"},
                                       .searched = "at_s"}})

}  // namespace fastcal
