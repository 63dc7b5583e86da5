// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Harmonic error of a gear or encoder:  dq = sine sin(n q) + cosine cos(n q) = amplitude sin(n q + phase),
// n cycles a turn of the joint, any number of at least 1: `order` at the joint's side, `order` times the motor ratio
// with side = motor. Encoder eccentricity e at a track of radius r is order 1 with amplitude e / r; a strain wave gear
// errs twice a turn of its motor. Source: T. Nye, R. Kraml, "Harmonic drive gear error: characterization and
// compensation for precision pointing and tracking" (1991).
#include <cmath>
#include <sstream>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

double cycles(const RobotModel& robot, int joint, const Options& options) {
  const double order = number_option(options, "order", 1);
  FASTCAL_CHECK(order >= 1) << "gear_harmonic: order must be at least 1 cycle a turn, got " << order;
  const std::string side = text_option(options, "side", "joint");
  FASTCAL_CHECK(side == "joint" || side == "motor")
      << "gear_harmonic: side must be joint or motor, got '" << side << "'";
  if (side == "joint") return order;
  const Eigen::VectorXd& ratios = robot.description().motor_ratio;
  const double ratio =
      std::abs(number_option(options, "motor_ratio", ratios.size() > joint ? ratios[joint] : std::nan("")));
  FASTCAL_CHECK(std::isfinite(ratio)) << "gear_harmonic: side=motor needs the motor_ratio of joint" << joint + 1
                                      << " in the robot file or as an option";
  FASTCAL_CHECK(order * ratio >= 1) << "gear_harmonic: order times motor_ratio must be at least 1, got "
                                    << order * ratio;
  return order * ratio;
}

class GearHarmonic : public LinearEffect {
 public:
  GearHarmonic(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("gear_harmonic", "joint", owner, robot.joint_count())) {
    FASTCAL_CHECK(robot.description().joint_types[static_cast<std::size_t>(joint_)] == JointType::kRevolute)
        << "gear_harmonic is for joints that turn, and " << owner << " slides";
    check_options("gear_harmonic", options, {"order", "side", "motor_ratio"});
    cycles_ = cycles(robot, joint_, options);
    std::ostringstream tail;
    tail << "_" << cycles_ << "x";  // several orders of one joint are distinguished by their names
    parameters_ = {{owner, "sine" + tail.str(), "rad", 3e-4, "joint error along sin(order q)"},
                   {owner, "cosine" + tail.str(), "rad", 3e-4, "joint error along cos(order q)"}};
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double angle = cycles_ * state.q[joint_];
    Vector6d xi = Vector6d::Zero();
    xi[5] = std::sin(angle);
    columns.push_back({0, joint_frame(joint_), xi});
    xi[5] = std::cos(angle);
    columns.push_back({1, joint_frame(joint_), xi});
  }

 private:
  int joint_;
  double cycles_ = 1;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("gear_harmonic", {make<GearHarmonic>,
                                          revolute_owners,
                                          {.phrase = "a periodic gear or encoder error",
                                           .place = Place::kJoint,
                                           .depends_on = {"q{n}"},
                                           .shown_by = kShownByMotion,
                                           .refers_to = Reference::kAxes,
                                           .plotted_over = "q{n}",
                                           .options_from_data = {"order"},
                                           .among_parameters = {"order"},
                                           .searched = "order",
                                           .is_wave = true}})

}  // namespace fastcal
