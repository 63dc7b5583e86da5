// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Settling: the pose was measured before the joint had come to rest, or grease and belts still yield:
//   dq = k m,   m [rad, m] the joint's last move, 0 where it is unknown.
// The moves follow from the order of rows, so whoever makes the samples writes them into the column `index` of
// State::extra.
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class Settling : public LinearEffect {
 public:
  Settling(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("settling", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        parameters_{{owner, "", types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute ? "rad_rad" : "m_m",
                     1e-4, "share of the last move that is still missing (negative) or too much"}},
        index_(static_cast<int>(number_option(options, "index", 0))) {
    check_options("settling", options, {"index"});
    FASTCAL_CHECK(index_ >= 0) << "settling: index must not be negative, got " << index_;
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double move = state.extra != nullptr ? state.extra[index_] : 0;
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, move)});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  std::vector<Parameter> parameters_;
  int index_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT(
    "settling", {make<Settling>,
                 joint_owners,
                 {.phrase = "settling after its last move",
                  .role = Role::kOnRequest,
                  .place = Place::kJoint,
                  .depends_on = {"move{n}"},
                  .shown_by = "rows in the order in which they were measured, with long and short moves of {owner}",
                  .refers_to = Reference::kAxes,
                  .number = "share of the last move"}})

}  // namespace fastcal
