// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Joint profile: a smooth curve of joint error over the joint's position,  dq = sum_k c_k phi_k(q),  phi_k the smooth
// basis of smooth_curves.hpp over the range [low, high] that it was fitted on (or over a whole turn: periodic = 1).
// Outside the range it goes on as a straight line that a window takes to zero, slope and all, within 5 degrees (5 mm of
// a slider). The constant is left out: it is the joint's offset. Source: P. Eilers, B. Marx, "Flexible smoothing with
// B-splines and penalties" (1996); the penalty is on the curvature, as in C. Reinsch, "Smoothing by spline functions"
// (1967).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/smooth_curves.hpp"

namespace fastcal {
namespace {

constexpr double kFadeAngle = 5 * std::numbers::pi / 180;
constexpr double kFadeLength = 5e-3;
constexpr double kKnotAngle = 4 * std::numbers::pi / 180;  // between knots, where `knots` is not given: 8 to 48 of them
constexpr double kKnotLength = 0.02;

class JointProfile : public LinearEffect {
 public:
  JointProfile(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("joint_profile", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        turns_(types_[static_cast<std::size_t>(joint_)] == JointType::kRevolute),
        periodic_(number_option(options, "periodic", 0) != 0),
        low_(periodic_ ? -std::numbers::pi : number_option(options, "low", -std::numbers::pi)),
        high_(periodic_ ? std::numbers::pi : number_option(options, "high", std::numbers::pi)),
        curves_(make_curves(options)) {
    check_options("joint_profile", options, {"low", "high", "knots", "periodic"});
    for (int k = 0; k < curves_.count(); ++k) {
      parameters_.push_back({owner, "curve" + std::to_string(k + 1), turns_ ? "rad" : "m", turns_ ? 3e-4 : 1e-4,
                             "RMS size of this part of the curve over its range"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  std::vector<double> penalty() const override {
    const Eigen::VectorXd& roughness = curves_.roughness();
    return {roughness.data(), roughness.data() + roughness.size()};
  }

  void basis(const State& state, TwistColumns& columns) const override {
    const double q = state.q[joint_];
    const double inside = periodic_ ? q : std::clamp(q, low_, high_);
    const double u = std::abs(q - inside) / (turns_ ? kFadeAngle : kFadeLength);
    if (u >= 1) return;
    Eigen::VectorXd value = curves_.values(inside);
    if (u > 0) {
      const double window = 1 - u * u * u * (10 - 15 * u + 6 * u * u);
      value = window * (value + (q - inside) * curves_.slopes(inside));
    }
    const Vector6d motion = joint_motion(types_, joint_, 1);
    for (int k = 0; k < curves_.count(); ++k) columns.push_back({k, joint_frame(joint_), value[k] * motion});
  }

 private:
  SmoothCurves make_curves(const Options& options) const {
    FASTCAL_CHECK(turns_ || !periodic_) << "joint_profile: a joint that slides has no period";
    FASTCAL_CHECK(std::isfinite(low_) && std::isfinite(high_) && low_ < high_)
        << "joint_profile: low must be below high, got " << low_ << " and " << high_;
    const double knots = number_option(
        options, "knots", std::clamp(std::ceil((high_ - low_) / (turns_ ? kKnotAngle : kKnotLength)), 8.0, 48.0));
    FASTCAL_CHECK(knots >= 4 && knots <= 1000 && knots == std::floor(knots))
        << "joint_profile: knots must be a whole number from 4 to 1000, got " << knots;
    return {low_, high_, static_cast<int>(knots), periodic_};
  }

  int joint_;
  std::vector<JointType> types_;
  bool turns_;
  bool periodic_;
  double low_, high_;
  SmoothCurves curves_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("joint_profile", {make<JointProfile>,
                                          joint_owners,
                                          {.phrase = "a position error of unknown shape",
                                           .role = Role::kCurve,
                                           .place = Place::kJoint,
                                           .depends_on = {"q{n}"},
                                           .shown_by = kShownByMotion,
                                           .generalizes = {"reduction_ratio", "gear_harmonic"},
                                           .refers_to = Reference::kAxes,
                                           .plotted_over = "q{n}",
                                           .options_from_data = {"range"}}})

}  // namespace fastcal
