// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The spring that carries a part of the weight is stiffer than the robot file says: its moment about the joint is (1 +
// stiffness_scale) times the nominal one. It pulls with k (L - L0) along the line between its anchor on the link before
// and its arm on the joint; the nominal moment is part of the joint's load (statics.hpp), its error acts as any change
// of load, through the joint's compliance.
#include "fastcal/effects/weight_effect.hpp"

namespace fastcal {
namespace {

std::vector<std::string> spring_owners(const RobotModel& robot) {
  const auto& spring = robot.description().compensator;
  return spring ? std::vector<std::string>{"joint" + std::to_string(spring->joint + 1)} : std::vector<std::string>();
}

class CompensatorSpring : public WeightEffect {
 public:
  CompensatorSpring(const RobotModel& robot, const std::string& owner, const Options& options)
      : WeightEffect(robot),
        parameters_{{owner, "stiffness_scale", "1", 0.05, "relative error of the spring's stiffness", -1}} {
    const auto owners = spring_owners(robot);
    FASTCAL_CHECK(!owners.empty()) << "compensator_spring needs a robot with a compensator, and this one has none";
    FASTCAL_CHECK(owner == owners[0]) << "compensator_spring is owned by " << owners[0] << ", got '" << owner << "'";
    check_options("compensator_spring", options, {});
    joint_ = robot.description().compensator->joint;
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void add_weights(const double* theta, Weights& weights) const override { weights.spring_scale += theta[0]; }
  double settled(const Weights& weights, int) const override { return weights.spring_scale; }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, state.compliance[joint_] * state.spring)});
  }

 private:
  int joint_ = 0;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("compensator_spring",
                        {make<CompensatorSpring>,
                         spring_owners,
                         {.phrase = "a gravity compensator that is stiffer or softer than the file says",
                          .place = Place::kJoint,
                          .depends_on = {"q{n}"},
                          .needs_data = "a compensator in the robot file",
                          .shown_by = "a compensator in the robot file and poses that change its angle"}})

}  // namespace fastcal
