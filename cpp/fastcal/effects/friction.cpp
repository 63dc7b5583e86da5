// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Friction in a loaded gear: the joint stops short by what friction holds, which grows with the load on the teeth,
//   dq = k s |tau|,   s = +-1 the direction in which the joint last moved (0: unknown), tau [N m, N] its load.
// k is the compliance behind the gear times its coefficient of friction; of either sign, for a controller may
// overshoot.
#include <cmath>

#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class Friction : public LinearEffect {
 public:
  Friction(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("friction", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        type_(types_[static_cast<std::size_t>(joint_)]),
        parameters_{{owner, "", type_ == JointType::kRevolute ? "rad_nm" : "m_n", plausible_compliance(robot, type_),
                     "turn per size of the load, to the side that the joint came from or from it"}} {
    check_options("friction", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }
  std::vector<std::string> data_columns() const override { return {"approach" + std::to_string(joint_ + 1)}; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double side = state.approach != nullptr ? state.approach[joint_] : 0;
    const double load = std::abs(state.joint_load(state.load, joint_, type_));
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, side * load)});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  JointType type_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("friction",
                        {make<Friction>,
                         joint_owners,
                         {.phrase = "friction that grows with its load",
                          .role = Role::kOnRequest,
                          .place = Place::kJoint,
                          .depends_on = {"approach{n}", "torque"},
                          .needs_data = "approach{n} that takes both signs",
                          .shown_by = "poses and payloads that load {owner} differently, each reached from both sides",
                          .refers_to = Reference::kAxes,
                          .plotted_over = "approach{n}",
                          .number = "turn per load"}})

}  // namespace fastcal
