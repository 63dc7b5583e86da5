// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A link is heavier than the robot file says by `extra` [kg] at its centre of gravity. Where the file gives no mass,
// the centre is half way along the link and the mass is an unknown like any other. Its plausible size is its prior
// where it is a nuisance (`prior=yes`).
#include "fastcal/effects/weight_effect.hpp"

namespace fastcal {
namespace {

constexpr double kShare = 0.06;        // what masses of a data sheet or of CAD miss by
constexpr double kUnknownMass = 10.0;  // [kg] where there is no mass to take a share of

class LinkMass : public WeightEffect {
 public:
  LinkMass(const RobotModel& robot, const std::string& owner, const Options& options)
      : WeightEffect(robot), link_(owner_index("link_mass", "link", owner, robot.joint_count())) {
    check_options("link_mass", options, {});
    const auto i = static_cast<std::size_t>(link_);
    const Body& body = robot.description().bodies[i];
    p_joint_com_ = robot.chain().body_frames[i] * body.com;
    const double size = body.mass > 0 ? kShare * body.mass : kUnknownMass;
    parameters_ = {{owner, "extra", "kg", size, "mass beyond the robot file's", -body.mass}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void add_weights(const double* theta, Weights& weights) const override { weights.mass[link_] += theta[0]; }
  double settled(const Weights& weights, int) const override { return weights.mass[link_]; }

  void basis(const State& state, TwistColumns& columns) const override {
    push_weight(state, link_, 0, 1, state.frames[joint_frame(link_)] * p_joint_com_, columns);
  }

 private:
  int link_;
  Eigen::Vector3d p_joint_com_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("link_mass", {make<LinkMass>,
                                      link_owners,
                                      {.phrase = "a wrong mass of a link",
                                       .role = Role::kNuisance,
                                       .place = Place::kLink,
                                       .depends_on = {"q"},
                                       .shown_by = "a compliance in the model and poses that change the link's lever"}})

}  // namespace fastcal
