// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Encoder jump: from a position of joint n on it stands elsewhere than its encoder says,
//   dq_n = s jump / 2,   s = 1 where q_n > at, else -1;
// `at` [rad, m] is a position of the same joint. Half of it on either side: the mean belongs to the joint's zero.
// Source: the law of posture backlash (posture_backlash.cpp), where the joint itself decides.
#include <limits>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class EncoderJump : public LinearEffect {
 public:
  EncoderJump(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("encoder_jump", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        at_(number_option(options, "at", std::numeric_limits<double>::infinity())) {
    check_options("encoder_jump", options, {"at"});
    const bool turns = types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute;
    parameters_ = {{owner, "jump", turns ? "rad" : "m", turns ? 3e-4 : 1e-4, "error of the position beyond the jump"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double side = state.q[joint_] > at_ ? 1 : -1;
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, side / 2)});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  double at_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("encoder_jump", {make<EncoderJump>,
                                         joint_owners,
                                         {.phrase = "a jump of the encoder at one position",
                                          .role = Role::kScanned,
                                          .place = Place::kJoint,
                                          .depends_on = {"q{n}"},
                                          .shown_by = "poses with joint{n} on both sides of the jump",
                                          .refers_to = Reference::kAxes,
                                          .plotted_over = "q{n}",
                                          .among_parameters = {"at_deg", "at_mm"},
                                          .searched = "at_deg"}})

}  // namespace fastcal
