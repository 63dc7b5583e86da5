// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The payload is heavier than the data say: `extra` [kg] in every row that carries one, at the payload's centre.
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/weight_effect.hpp"

namespace fastcal {
namespace {

class PayloadMass : public WeightEffect {
 public:
  PayloadMass(const RobotModel& robot, const std::string& owner, const Options& options)
      : WeightEffect(robot),
        p_flange_payload_(robot.description().p_flange_payload),
        parameters_{{owner, "extra", "kg", 0.01 * arm_mass(robot), "mass of the payload beyond what the data say"}} {
    check_payload_owner("payload_mass", owner);
    check_options("payload_mass", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void add_weights(const double* theta, Weights& weights) const override { weights.payload_mass += theta[0]; }
  double settled(const Weights& weights, int) const override { return weights.payload_mass; }

  void basis(const State& state, TwistColumns& columns) const override {
    if (!(state.payload > 0)) return;
    const int last = static_cast<int>(types_.size()) - 1;
    const Eigen::Vector3d centre =
        state.frames[link_frame(last)] * (p_flange_payload_ + state.weights->payload_shift).eval();
    push_weight(state, last, 0, 1, centre, columns);
  }

 private:
  Eigen::Vector3d p_flange_payload_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("payload_mass", {make<PayloadMass>,
                                         payload_owners,
                                         {.phrase = "a wrong payload mass",
                                          .role = Role::kLoadModifier,
                                          .place = Place::kPayload,
                                          .depends_on = {"payload_kg"},
                                          .shown_by = "a compliance in the model and payload_kg that varies",
                                          .refers_to = Reference::kAxes}})

}  // namespace fastcal
