// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A link's centre of gravity is not where the robot file says: its first moment, mass times centre, differs by `moment`
// [kg m] in the body's frame. The moment is what joints feel, so it stays linear where the mass is unknown too; moment
// / mass is the shift [m]. Its plausible size is its prior where it is a nuisance (`prior=yes`).
#include "fastcal/effects/weight_effect.hpp"

namespace fastcal {
namespace {

constexpr double kShift = 0.01;       // [m] what centres of a data sheet or of CAD miss by
constexpr double kUnknownMoment = 1;  // [kg m] where the file gives no mass

class LinkCom : public WeightEffect {
 public:
  LinkCom(const RobotModel& robot, const std::string& owner, const Options& options)
      : WeightEffect(robot), link_(owner_index("link_com", "link", owner, robot.joint_count())) {
    check_options("link_com", options, {});
    const auto i = static_cast<std::size_t>(link_);
    R_joint_body_ = robot.chain().body_frames[i].R;
    const double mass = robot.description().bodies[i].mass;
    const double size = mass > 0 ? kShift * mass : kUnknownMoment;
    for (const std::string axis : {"x", "y", "z"}) {
      parameters_.push_back(
          {owner, "moment_" + axis, "kg_m", size, "mass times shift of the centre of gravity along " + axis});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double settled(const Weights& weights, int parameter) const override { return weights.moment(parameter, link_); }

  void add_weights(const double* theta, Weights& weights) const override {
    weights.moment.col(link_) += Eigen::Map<const Eigen::Vector3d>(theta);
  }

  void basis(const State& state, TwistColumns& columns) const override {
    const Eigen::Matrix3d R = state.frames[joint_frame(link_)].R * R_joint_body_;
    for (int k = 0; k < 3; ++k) push_weight(state, link_, k, 0, R.col(k), columns);
  }

 private:
  int link_;
  Eigen::Matrix3d R_joint_body_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("link_com", {make<LinkCom>,
                                     link_owners,
                                     {.phrase = "a wrong centre of gravity of a link",
                                      .role = Role::kNuisance,
                                      .place = Place::kLink,
                                      .depends_on = {"q"},
                                      .shown_by = "a compliance in the model and poses that change the link's lever"}})

}  // namespace fastcal
