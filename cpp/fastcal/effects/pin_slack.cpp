// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Slack in a pin of a closed loop: what turns about it lies against one side of its hole, the side where the load
// presses it,
//   (x, y) = gap/2 (F_x, F_y) / (F_x^2 + F_y^2 + F_0^2)^(1/2),
// F [N] the force on the pin across its axis, of all that hangs beyond it and of the loops that end there; gap [m] the
// diameter of the hole less that of the pin. Below F_0 = 1 N it floats. Along its axis the pin is held.
#include <cmath>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

constexpr double kSize = 2e-4;   // [m] a worn bush
constexpr double kFloats = 1.0;  // [N]

class PinSlack : public LinearEffect {
 public:
  PinSlack(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(pin_index("pin_slack", owner, robot)),
        parameters_{{owner, "gap", "m", kSize, "diameter of the hole less that of the pin", 0}} {
    check_options("pin_slack", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  void basis(const State& state, TwistColumns& columns) const override {
    const Eigen::Map<const Eigen::Vector2d> force(state.load + 6 * joint_frame(joint_));
    Vector6d xi = Vector6d::Zero();
    xi.head<2>() = force / (2 * std::sqrt(force.squaredNorm() + kFloats * kFloats));
    columns.push_back({0, joint_frame(joint_), xi});
  }

 private:
  int joint_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("pin_slack", {make<PinSlack>,
                                      pin_owners,
                                      {.phrase = "slack in a pin of a closed loop",
                                       .place = Place::kJoint,
                                       .depends_on = {"load"},
                                       .needs_data = "masses in the robot file, or payloads",
                                       .shown_by = "poses and payloads in which the load on the pin reverses",
                                       .number = "gap"}})

}  // namespace fastcal
