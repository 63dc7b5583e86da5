// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The payload's centre of gravity is shifted in the flange frame, by the same `shift` [m] in every row that carries
// one. The point at which a measured wrench is given stays where it is.
#include "fastcal/effects/weight_effect.hpp"

namespace fastcal {
namespace {

class PayloadCom : public WeightEffect {
 public:
  PayloadCom(const RobotModel& robot, const std::string& owner, const Options& options) : WeightEffect(robot) {
    check_payload_owner("payload_com", owner);
    check_options("payload_com", options, {});
    for (const std::string axis : {"x", "y", "z"}) {
      parameters_.push_back(
          {owner, "shift_" + axis, "m", 0.01, "shift of the payload's centre of gravity along the flange's " + axis});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double settled(const Weights& weights, int parameter) const override { return weights.payload_shift[parameter]; }

  void add_weights(const double* theta, Weights& weights) const override {
    weights.payload_shift += Eigen::Map<const Eigen::Vector3d>(theta);
  }

  void basis(const State& state, TwistColumns& columns) const override {
    if (!(state.payload > 0)) return;
    const int last = static_cast<int>(types_.size()) - 1;
    const double mass = state.payload + state.weights->payload_mass;
    const Eigen::Matrix3d& R = state.frames[link_frame(last)].R;
    for (int k = 0; k < 3; ++k) push_weight(state, last, k, 0, mass * R.col(k), columns);
  }

 private:
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("payload_com", {make<PayloadCom>,
                                        payload_owners,
                                        {.phrase = "a wrong payload centre",
                                         .role = Role::kLoadModifier,
                                         .place = Place::kPayload,
                                         .depends_on = {"payload_kg"},
                                         .shown_by = "a compliance in the model and payload_kg that varies",
                                         .refers_to = Reference::kFlange}})

}  // namespace fastcal
