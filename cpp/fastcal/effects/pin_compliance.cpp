// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A pin of a closed loop that yields: its bearing, or the lever that it sits in, gives way across its axis,
//   (x, y) = c (F_x, F_y),
// F [N] the force on the pin across its axis, of all that hangs beyond it and of the loops that end there; c in m/N.
// Where the load tilts it, bearing_tilt does the same with moments.
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class PinCompliance : public LinearEffect {
 public:
  PinCompliance(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(pin_index("pin_compliance", owner, robot)),
        parameters_{{owner, "compliance", "m_n", plausible_compliance(robot, JointType::kPrismatic),
                     "shift across the pin's axis per force", 0}} {
    check_options("pin_compliance", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  void basis(const State& state, TwistColumns& columns) const override {
    Vector6d xi = Vector6d::Zero();
    xi.head<2>() = Eigen::Map<const Eigen::Vector2d>(state.load + 6 * joint_frame(joint_));
    columns.push_back({0, joint_frame(joint_), xi});
  }

 private:
  int joint_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("pin_compliance",
                        {make<PinCompliance>,
                         pin_owners,
                         {.phrase = "a pin of a closed loop that yields",
                          .place = Place::kJoint,
                          .depends_on = {"load"},
                          .needs_data = "masses in the robot file, or payloads",
                          .shown_by = "poses and payloads in which the load on the pin varies in size"}})

}  // namespace fastcal
