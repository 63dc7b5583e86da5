// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Cable pull: a cable along the arm twists as joint j and its neighbour turn, and pulls at joint j:
//   dq_j = pull q_j q_(j+1),   pull in rad per rad^2.
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class CablePull : public LinearEffect {
 public:
  CablePull(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("cable_pull", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        parameters_{{owner, "pull", "rad", 1e-4, "turn of the joint per square radian of twist"}} {
    check_options("cable_pull", options, {});
    FASTCAL_CHECK(joint_ + 1 < robot.joint_count())
        << "cable_pull needs a joint behind its own, and " << owner << " is the last";
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double twist = state.q[joint_] * state.q[joint_ + 1];
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, twist)});
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  std::vector<Parameter> parameters_;
};

std::vector<std::string> all_but_the_last(const RobotModel& robot) {
  std::vector<std::string> out = joint_owners(robot);
  out.pop_back();
  return out;
}

}  // namespace

FASTCAL_REGISTER_EFFECT("cable_pull", {make<CablePull>,
                                       all_but_the_last,
                                       {.phrase = "a cable that pulls",
                                        .place = Place::kJoint,
                                        .depends_on = {"q{n}"},
                                        .shown_by = kShownByMotion,
                                        .refers_to = Reference::kAxes,
                                        .plotted_over = "q{n}"}})

}  // namespace fastcal
