// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Backlash: the joint rests on one flank of its gap or the other,  dq = s gap / 2.
// side = approach: s the direction in which the joint last moved, 0 where it is unknown.
// side = load: the load on the joint presses it to a flank,  s = tanh(tau / width), width [N m, N] the load that does
// so for sure.
#include <cmath>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class Backlash : public LinearEffect {
 public:
  Backlash(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("backlash", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        by_load_(text_option(options, "side", "approach") == "load"),
        width_(number_option(options, "width", 1)) {
    check_options("backlash", options, {"side", "width"});
    FASTCAL_CHECK(by_load_ || text_option(options, "side", "approach") == "approach")
        << "backlash: side must be approach or load";
    FASTCAL_CHECK(width_ > 0) << "backlash: width must be above 0, got " << width_;
    const bool turns = types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute;
    parameters_ = {{owner, by_load_ ? "load_gap" : "gap", turns ? "rad" : "m", turns ? 3e-4 : 1e-4,
                    "distance between the flanks, at the joint"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return by_load_ ? kLoads : kNothing; }
  std::vector<std::string> data_columns() const override {
    return by_load_ ? std::vector<std::string>{} : std::vector<std::string>{"approach" + std::to_string(joint_ + 1)};
  }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, flank(state) / 2)});
  }

 private:
  double flank(const State& state) const {
    if (!by_load_) return state.approach != nullptr ? state.approach[joint_] : 0;
    return std::tanh(state.joint_load(state.load, joint_, types_[static_cast<std::size_t>(joint_)]) / width_);
  }

  int joint_;
  std::vector<JointType> types_;
  bool by_load_;
  double width_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("backlash", {make<Backlash>,
                                     joint_owners,
                                     {.phrase = "backlash (lost motion)",
                                      .place = Place::kJoint,
                                      .depends_on = {"approach{n}"},
                                      .needs_data = "approach{n} that takes both signs",
                                      .shown_by = "poses that {owner} reaches from both sides",
                                      .refers_to = Reference::kAxes,
                                      .plotted_over = "approach{n}",
                                      .forms = {"side=load:width_nm"}}})

}  // namespace fastcal
