// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Tool shift: each time it is mounted the target sits a little elsewhere,  xi = shift of the row's mount along the
// tool's axes, and with `target` pose about them as well; the first mount defines the tool. Option `count`: how many
// mounts there are, the first included; State::mount counts from 0.
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class ToolShift : public LinearEffect {
 public:
  ToolShift(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())) {
    check_owner("tool_shift", owner, "tool");
    check_options("tool_shift", options, {"count", "target"});
    const std::string target = text_option(options, "target", "point");
    FASTCAL_CHECK(target == "point" || target == "pose")
        << "tool_shift target must be 'point' or 'pose', got '" << target << "'";
    axes_ = target == "pose" ? 6 : 3;
    const double count = number_option(options, "count", 2);
    FASTCAL_CHECK(count >= 2) << "tool_shift needs at least two mounts, got " << count;
    for (int mount = 2; mount <= static_cast<int>(count); ++mount) {
      for (int axis = 0; axis < axes_; ++axis) {
        parameters_.push_back({owner, "mount" + std::to_string(mount) + "_" + kAxes[axis], axis < 3 ? "m" : "rad",
                               axis < 3 ? 5e-5 : 5e-4, "where the target sits, against the first mount"});
      }
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  std::vector<std::string> data_columns() const override { return {"mount"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    if (state.mount < 1) return;
    for (int axis = 0; axis < axes_; ++axis)
      columns.push_back({axes_ * (state.mount - 1) + axis, frame_, Vector6d::Unit(axis)});
  }

 private:
  int frame_;
  int axes_ = 3;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("tool_shift", {make<ToolShift>,
                                       single_owner("tool"),
                                       {.phrase = "a shift of the target between its mounts",
                                        .place = Place::kTool,
                                        .depends_on = {"mount"},
                                        .needs_data = "two mounts or more in the column mount",
                                        .shown_by = "poses that are measured with each mount",
                                        .refers_to = Reference::kFlange,
                                        .of_the_measurement = true,
                                        .plotted_over = "mount",
                                        .options_from_data = {"mounts"},
                                        .labels = "mounts"}})

}  // namespace fastcal
