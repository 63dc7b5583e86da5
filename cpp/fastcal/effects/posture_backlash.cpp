// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Posture backlash: joint i rests on one flank of its gap or the other, by where another joint j stands,
//   dq_i = s gap / 2,   s = 1 where q_j > at, else -1;
// `at` [rad, m] is a position of joint j. Source: the two heaps of errors in figure 16 of the PMC6VA030 paper.
#include <limits>
#include <tuple>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class PostureBacklash : public LinearEffect {
 public:
  PostureBacklash(const RobotModel& robot, const std::string& owner, const Options& options)
      : types_(robot.description().joint_types),
        at_(number_option(options, "at", std::numeric_limits<double>::infinity())) {
    check_options("posture_backlash", options, {"at"});
    std::tie(joint_, decides_) = joint_pair("posture_backlash", owner, robot.joint_count());
    const bool turns = types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute;
    parameters_ = {
        {owner, "gap", turns ? "rad" : "m", turns ? 3e-4 : 1e-4, "distance between the flanks, at the joint"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double side = state.q[decides_] > at_ ? 1 : -1;
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, side / 2)});
  }

 private:
  int joint_ = 0;
  int decides_ = 0;
  std::vector<JointType> types_;
  double at_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("posture_backlash", {make<PostureBacklash>,
                                             joint_pair_owners,
                                             {.phrase = "backlash whose direction depends on another joint's position",
                                              .role = Role::kScanned,
                                              .place = Place::kJoint,
                                              .depends_on = {"q{m}"},
                                              .shown_by = "poses with joint{m} on both sides of the jump",
                                              .refers_to = Reference::kAxes,
                                              .plotted_over = "q{m}",
                                              .among_parameters = {"at_deg", "at_mm"},
                                              .searched = "at_deg"}})

}  // namespace fastcal
