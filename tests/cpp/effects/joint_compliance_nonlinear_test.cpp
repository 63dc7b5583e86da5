// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Nonlinear compliance: laws worked out by hand, on a level arm with a load of -49.03325 N m (link alone).
#include <gtest/gtest.h>

#include <cmath>

#include "effects/loaded.hpp"
#include "fastcal/math/check.hpp"
#include "support/random.hpp"

namespace fastcal::test {
namespace {

constexpr double kTau = -49.03325;

double turn(const std::vector<double>& values, const Options& options = {}, double payload = 0, double q = 0) {
  const ErrorModel model =
      with(level_arm(), {{"joint_compliance_nonlinear", "joint1", values, options}}).with_equilibrium(false);
  return twists(model, posture({q}, payload))(5, joint_frame(0));
}

TEST(NonlinearCompliance, BendsAtTheCriticalLoad) {
  EXPECT_NEAR(turn({1e-5, 4e-6, 30}), -(30e-5 + 19.03325 * 4e-6), 1e-18);
  EXPECT_NEAR(turn({1e-5, 4e-6, 60}), kTau * 1e-5, 1e-18);
  EXPECT_NEAR(turn({1e-5, 4e-6, 0}), kTau * 4e-6, 1e-18);
  EXPECT_NEAR(turn({1e-5, 4e-6, 30}, {}, 0, 2 * kHalfPi), 30e-5 + 19.03325 * 4e-6, 1e-15);  // arm turned over: odd
}

TEST(NonlinearCompliance, IsContinuousAtTheCorner) {
  const double at = -kTau;
  EXPECT_NEAR(turn({1e-5, 4e-6, at - 1e-9}), turn({1e-5, 4e-6, at + 1e-9}), 1e-13);
}

TEST(NonlinearCompliance, TakesAnyNumberOfPieces) {
  const Options three{{"pieces", 3.0}};
  EXPECT_NEAR(turn({1e-5, 4e-6, 1e-6, 10, 30}, three), -(10e-5 + 20 * 4e-6 + 19.03325e-6), 1e-18);
  const auto names = make_effect("joint_compliance_nonlinear", level_arm(), "joint1", three)->parameters();
  EXPECT_EQ(names[2].name, "compliance_3");
  EXPECT_EQ(names[4].name, "critical_2");
  EXPECT_EQ(names[4].unit, "nm");
}

TEST(NonlinearCompliance, TakesThePayloadsLoadAlone) {
  // 3 kg at the flange, 1 m out.
  EXPECT_NEAR(turn({1e-5, 4e-6, 20}, {{"torque", "payload"}}, 3), -(20e-5 + (3 * kG - 20) * 4e-6), 1e-18);
}

TEST(NonlinearCompliance, TheCubicIsTheRootOfThePapersPolynomial) {
  // tau = a d^3 + b d^2 + c d (RX160L paper, 9) with 4 b^2 <= 12 a c (10), at d = -4e-4.
  const double c = 1e5, b = 2e7, d = -4e-4;
  const double a = (kTau - b * d * d - c * d) / (d * d * d);
  ASSERT_LT(4 * b * b, 12 * a * c);
  const std::vector<double> values{1 / c, b / c, (3 * a * c - b * b) / (c * c)};
  EXPECT_NEAR(turn(values, {{"form", "cubic"}}), d, 1e-17);
}

TEST(NonlinearCompliance, BelowItsBoundTheCubicIsTheLawOfTheBound) {
  for (double skew : {0.0, 30.0, -30.0}) {  // a cubic that falls again would have no root here
    EXPECT_EQ(turn({1e-3, skew, -1e8}, {{"form", "cubic"}}), turn({1e-3, skew, 0}, {{"form", "cubic"}}));
  }
}

TEST(NonlinearCompliance, SlopesAreExact) {
  Random random(3);
  for (const Options& options : {Options{}, Options{{"pieces", 4.0}}, Options{{"form", "cubic"}}}) {
    const RobotModel robot = level_arm();
    const auto effect = make_effect("joint_compliance_nonlinear", robot, "joint1", options);
    const ErrorModel model(robot, {effect});
    Samples samples = posture({0.2});
    settle(model, model.start(), 1, samples);
    for (int repeat = 0; repeat < 20; ++repeat) {
      const bool cubic = options.count("form") > 0;
      Eigen::VectorXd theta(static_cast<Eigen::Index>(effect->parameters().size()));
      for (Eigen::Index k = 0; k < theta.size(); ++k) {
        const bool critical = effect->parameters()[static_cast<std::size_t>(k)].unit == "nm";
        theta[k] = critical          ? random.uniform(1, 60)
                   : cubic && k == 1 ? random.uniform(-900, 900)
                   : cubic && k == 2 ? random.uniform(1e5, 1e7)
                                     : random.uniform(1e-6, 1e-5);
      }
      Twists xi = Twists::Zero(6, 4);
      TwistColumns columns;
      effect->deflect(samples.row(0), theta.data(), xi, &columns);
      ASSERT_EQ(columns.size(), static_cast<std::size_t>(theta.size()));
      for (const auto& column : columns) {
        const double h = 1e-6 * theta[column.parameter];
        const auto at = [&](double step) {
          Eigen::VectorXd moved = theta;
          moved[column.parameter] += step;
          Twists out = Twists::Zero(6, 4);
          effect->deflect(samples.row(0), moved.data(), out, nullptr);
          return out(5, joint_frame(0));
        };
        EXPECT_NEAR(column.xi[5], (at(h) - at(-h)) / (2 * h), 1e-6 * std::abs(column.xi[5]) + 1e-20 / std::abs(h));
      }
    }
  }
}

TEST(NonlinearCompliance, ItsComplianceIsTheSlopeOverTheLoad) {
  const RobotModel robot = level_arm();
  for (const Options& options : {Options{}, Options{{"form", "cubic"}}}) {
    const auto effect = make_effect("joint_compliance_nonlinear", robot, "joint1", options);
    const double theta[3] = {1e-5, options.empty() ? 4e-6 : 300.0, options.empty() ? 30.0 : 2e6};
    // The payload makes the load vary.
    const auto state = [&](double payload) {
      Samples samples = posture({0}, payload);
      settle(ErrorModel(robot, {effect}), ErrorModel(robot, {effect}).start(), 1, samples);
      return samples;
    };
    const auto turned = [&](double payload) {
      const Samples samples = state(payload);
      Twists xi = Twists::Zero(6, 4);
      effect->deflect(samples.row(0), theta, xi, nullptr);
      return xi(5, joint_frame(0));
    };
    const Samples samples = state(2);
    const double h = 1e-3;
    EXPECT_NEAR(effect->joint_compliance(samples.row(0), 0, theta), (turned(2 + h) - turned(2 - h)) / (-2 * h * kG),
                1e-11);
  }
}

TEST(NonlinearCompliance, RefusesWhatItDoesNotKnow) {
  for (const Options& options :
       {Options{{"form", "quintic"}}, Options{{"torque", "gravity"}}, Options{{"pieces", 1.0}},
        Options{{"pieces", 2.5}}, Options{{"form", "cubic"}, {"pieces", 3.0}}, Options{{"knee", 3.0}}}) {
    EXPECT_THROW(make_effect("joint_compliance_nonlinear", level_arm(), "joint1", options), InvalidInput);
  }
}

}  // namespace
}  // namespace fastcal::test
