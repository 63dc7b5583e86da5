// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Zero step: a joint's zero jumped once, as after a crash or where a coupling slipped,  dq = step from a moment on
// (moment.hpp).
#include "fastcal/effects/moment.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ZeroStep : public LinearEffect {
 public:
  ZeroStep(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("zero_step", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        moment_("zero_step", options) {
    check_moment_options("zero_step", options);
    const bool turns = types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute;
    parameters_ = {{owner, "step", turns ? "rad" : "m", turns ? 3e-4 : 1e-4, "jump of the joint's zero"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, moment_.share(state))});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  Moment moment_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("zero_step", {make<ZeroStep>,
                                      joint_owners,
                                      {.phrase = "a jump of its zero",
                                       .role = Role::kScanned,
                                       .place = Place::kJoint,
                                       .depends_on = {"time_s"},
                                       .needs_data = "rows in the order in which they were measured",
                                       .shown_by = "poses that are measured again later",
                                       .refers_to = Reference::kAxes,
                                       .among_parameters = {"at_s", "at_row"},
                                       .searched = "at_s"}})

}  // namespace fastcal
