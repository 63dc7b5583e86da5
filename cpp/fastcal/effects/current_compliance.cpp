// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Compliance from motor currents: dq_i = c_i I_i, I_i [A] the motor's current, c_i = C_e phi / k_i [rad/A] of either
// sign. It needs no masses, but sees friction as load, and a joint on its brake not at all. Source: SIASUN SR210D
// paper, equations 24 to 30.
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class CurrentCompliance : public LinearEffect {
 public:
  CurrentCompliance(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("current_compliance", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types) {
    check_options("current_compliance", options, {});
    const bool revolute = types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute;
    parameters_ = {{owner, "", revolute ? "rad_a" : "m_a", 1e-5, "turn of the joint per current of its motor"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  std::vector<std::string> data_columns() const override { return {"current" + std::to_string(joint_ + 1)}; }

  void basis(const State& state, TwistColumns& columns) const override {
    if (state.current != nullptr)
      columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, state.current[joint_])});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("current_compliance",
                        {make<CurrentCompliance>,
                         joint_owners,
                         {.phrase = "compliance that follows the motor current",
                          .place = Place::kJoint,
                          .depends_on = {"current{n}_a"},
                          .needs_data = "current{n}_a",
                          .shown_by = "poses and payloads over which the current of motor {n} varies",
                          .refers_to = Reference::kAxes,
                          .plotted_over = "current{n}_a",
                          .number = "turn per current"}})

}  // namespace fastcal
