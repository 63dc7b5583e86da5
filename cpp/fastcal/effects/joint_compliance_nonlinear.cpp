// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A joint whose compliance depends on its load tau (torque about, or force along its axis).
// Piecewise linear (default), continuous, corners at critical loads t_k, odd in tau; RX160L paper, equation 11 without
// its jump:
//   dq = sign(tau) (c_1 |tau| + sum_k (c_(k+1) - c_k) max(|tau| - t_k, 0))
// form=cubic, monotone; RX160L paper, equations 9 and 10 (tau = a d^3 + b d^2 + c d with 4 b^2 <= 12 a c), written as
//   compliance tau = d + skew d^2 + (skew^2 + hardening) d^3 / 3,   compliance = 1 / c, skew = b / c, hardening = (3 a
//   c - b^2) / c^2 >= 0,
// so that the condition is one bound and compliance = 0 is a rigid joint. Below the bound, where a fit may try a step,
// the law is that of the bound: the cubic would fall again and may have no root. torque=payload: tau of payload and
// wrench alone, as the paper.
#include <cmath>

#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr int kMostPieces = 20;

struct Piecewise {
  int pieces;

  /// d q / d theta into `slopes` (unless null); returns dq.
  double turn(double tau, const double* theta, double* slopes) const {
    const double* critical = theta + pieces;
    const double size = std::abs(tau);
    const double sign = tau < 0 ? -1 : 1;
    double sum = 0;
    double passed = size;  // what of |tau| lies beyond the last corner
    for (int k = 0; k < pieces; ++k) {
      const double beyond = k + 1 < pieces ? std::max(size - critical[k], 0.0) : 0;
      sum += theta[k] * (passed - beyond);
      if (slopes != nullptr) {
        slopes[k] = sign * (passed - beyond);
        if (k + 1 < pieces) slopes[pieces + k] = beyond > 0 ? sign * (theta[k] - theta[k + 1]) : 0;
      }
      passed = beyond;
    }
    return sign * sum;
  }

  double slope(double tau, const double* theta) const {
    double out = theta[0];
    for (int k = 0; k + 1 < pieces; ++k) out += std::abs(tau) > theta[pieces + k] ? theta[k + 1] - theta[k] : 0;
    return out;
  }
};

struct Cubic {
  double turn(double tau, const double* theta, double* slopes) const {
    const double target = theta[0] * tau;
    const double skew = theta[1];
    const double cube = cubed(theta);
    // Newton from the linear answer, kept in a bracket: the cubic is monotone, so there is one root, between 0 and far
    // enough out.
    double low = -1, high = 1;
    while (value(low, skew, cube) > target) low *= 2;
    while (value(high, skew, cube) < target) high *= 2;
    double d = std::min(std::max(target, low), high);
    for (int i = 0; i < 100; ++i) {
      const double miss = value(d, skew, cube) - target;
      (miss > 0 ? high : low) = d;
      double next = d - miss / steepness(d, skew, cube);
      if (!(next > low && next < high)) next = (low + high) / 2;
      if (std::abs(next - d) <= 1e-16 * std::abs(next)) break;
      d = next;
    }
    if (slopes != nullptr) {
      const double steep = steepness(d, skew, cube);
      slopes[0] = tau / steep;
      slopes[1] = -(d * d + 2 * skew * d * d * d / 3) / steep;
      slopes[2] = theta[2] < 0 ? 0 : -(d * d * d / 3) / steep;
    }
    return d;
  }

  double slope(double tau, const double* theta) const {
    return theta[0] / steepness(turn(tau, theta, nullptr), theta[1], cubed(theta));
  }

  static double cubed(const double* theta) { return (theta[1] * theta[1] + std::max(theta[2], 0.0)) / 3; }
  static double value(double d, double skew, double cube) { return d * (1 + d * (skew + d * cube)); }
  /// (1 + skew d)^2 + hardening d^2: 0 only where hardening is, at an inflection.
  static double steepness(double d, double skew, double cube) {
    return std::max(1 + d * (2 * skew + 3 * d * cube), 1e-12);
  }
};

template <typename Law>
class NonlinearCompliance : public Effect {
 public:
  NonlinearCompliance(Law law, int joint, JointType type, bool of_payload, std::vector<Parameter> parameters)
      : law_(law), joint_(joint), type_(type), of_payload_(of_payload), parameters_(std::move(parameters)) {}

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  double joint_compliance(const State& state, int joint, const double* theta) const override {
    return joint == joint_ ? law_.slope(load(state), theta) : 0;
  }

  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const override {
    double slopes[2 * kMostPieces];
    const int axis = type_ == JointType::kRevolute ? 5 : 2;
    xi(axis, joint_frame(joint_)) += law_.turn(load(state), theta, columns != nullptr ? slopes : nullptr);
    for (int k = 0; columns != nullptr && k < static_cast<int>(parameters_.size()); ++k) {
      columns->push_back({k, joint_frame(joint_), slopes[k] * Vector6d::Unit(axis)});
    }
  }

 private:
  double load(const State& state) const {
    return state.joint_load(of_payload_ ? state.payload_load : state.load, joint_, type_);
  }

  Law law_;
  int joint_;
  JointType type_;
  bool of_payload_;
  std::vector<Parameter> parameters_;
};

/// A load that the joint may well see: a fifth of what all links beyond it weigh, stretched out. Where no mass is
/// given: 100 N m, 100 N.
double plausible_load(const RobotModel& robot, int joint, JointType type) {
  double sum = 0, reach = 0;
  for (int i = joint; i < robot.joint_count(); ++i) {
    reach += robot.link_axis(i).norm();
    const double weight =
        robot.description().bodies[static_cast<std::size_t>(i)].mass * robot.description().gravity.norm();
    sum += weight * (type == JointType::kRevolute ? reach : 1);
  }
  return sum > 0 ? 0.2 * sum : 100;
}

std::vector<Parameter> piecewise_parameters(const std::string& owner, int pieces, bool named, bool revolute,
                                            double compliance, double load) {
  const std::string unit = revolute ? "rad_nm" : "m_n";
  std::vector<Parameter> out;
  for (int k = 1; k <= pieces; ++k) {
    const std::string name = named ? (k == 1 ? "low" : "high") : "compliance_" + std::to_string(k);
    out.push_back({owner, name, unit, compliance, "turn per torque in piece " + std::to_string(k), 0});
  }
  for (int k = 1; k < pieces; ++k) {
    const std::string name = named ? "critical" : "critical_" + std::to_string(k);
    out.push_back({owner, name, revolute ? "nm" : "n", load, "load at which piece " + std::to_string(k) + " ends", 0});
  }
  return out;
}

std::shared_ptr<const Effect> make_nonlinear(const RobotModel& robot, const std::string& owner,
                                             const Options& options) {
  const std::string effect = "joint_compliance_nonlinear";
  const int joint = owner_index(effect, "joint", owner, robot.joint_count());
  check_options(effect, options, {"form", "pieces", "torque"});
  const std::string form = text_option(options, "form", "piecewise");
  const std::string torque = text_option(options, "torque", "total");
  const double pieces = number_option(options, "pieces", 2);
  FASTCAL_CHECK(form == "piecewise" || form == "cubic")
      << effect << ": form is piecewise or cubic, got '" << form << "'";
  FASTCAL_CHECK(torque == "total" || torque == "payload")
      << effect << ": torque is total or payload, got '" << torque << "'";
  FASTCAL_CHECK(pieces >= 2 && pieces <= kMostPieces && pieces == std::floor(pieces))
      << effect << ": pieces is a whole number from 2 to " << kMostPieces << ", got " << pieces;
  FASTCAL_CHECK(form != "cubic" || options.count("pieces") == 0) << effect << ": the cubic form has no pieces";
  const JointType type = robot.description().joint_types[static_cast<std::size_t>(joint)];
  const bool revolute = type == JointType::kRevolute;
  const double compliance = plausible_compliance(robot, type);
  if (form == "cubic") {
    std::vector<Parameter> parameters{
        {owner, "compliance", revolute ? "rad_nm" : "m_n", compliance, "turn per torque without load", 0},
        {owner, "skew", revolute ? "1_rad" : "1_m", 1e2, "how the two directions of load differ"},
        {owner, "hardening", revolute ? "1_rad2" : "1_m2", 1e6, "how much stiffer than without load", 0}};
    return std::make_shared<NonlinearCompliance<Cubic>>(Cubic{}, joint, type, torque == "payload",
                                                        std::move(parameters));
  }
  const int count = static_cast<int>(pieces);
  auto parameters = piecewise_parameters(owner, count, options.count("pieces") == 0, revolute, compliance,
                                         plausible_load(robot, joint, type));
  return std::make_shared<NonlinearCompliance<Piecewise>>(Piecewise{count}, joint, type, torque == "payload",
                                                          std::move(parameters));
}

}  // namespace

FASTCAL_REGISTER_EFFECT("joint_compliance_nonlinear", {make_nonlinear,
                                                       joint_owners,
                                                       {.phrase = "compliance that changes with the load",
                                                        .place = Place::kJoint,
                                                        .depends_on = {"torque"},
                                                        .shown_by = kShownByLoads,
                                                        .generalizes = {"joint_compliance"},
                                                        .contrast = {"low", "high"},
                                                        .refers_to = Reference::kAxes,
                                                        .plotted_over = "torque",
                                                        .searched = "critical",
                                                        .forms = {"form=cubic", "torque=payload"}}})

}  // namespace fastcal
