// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Bearing tilt: the moments across a joint's axis tilt its bearing,  phi_x = c M_x, phi_y = c M_y,  M [N m] the load on
// the joint's frame, one c [rad/(N m)] for both directions, for a bearing is round.
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class BearingTilt : public LinearEffect {
 public:
  BearingTilt(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("bearing_tilt", "joint", owner, robot.joint_count())),
        parameters_{
            {owner, "", "rad_nm", 0.1 * plausible_compliance(robot), "tilt per moment across the joint's axis", 0}} {
    check_options("bearing_tilt", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  void basis(const State& state, TwistColumns& columns) const override {
    Vector6d xi = Vector6d::Zero();
    xi[3] = state.load[6 * joint_frame(joint_) + 3];
    xi[4] = state.load[6 * joint_frame(joint_) + 4];
    columns.push_back({0, joint_frame(joint_), xi});
  }

 private:
  int joint_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("bearing_tilt", {make<BearingTilt>,
                                         joint_owners,
                                         {.phrase = "a bearing that tilts under load",
                                          .place = Place::kJoint,
                                          .depends_on = {"load"},
                                          .shown_by = kShownByLoads,
                                          .number = "turn per moment"}})

}  // namespace fastcal
