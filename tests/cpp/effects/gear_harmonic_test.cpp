// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A wave of 3e-4 sin + 4e-4 cos has the size 5e-4 and is largest where tan(order q) = 3 / 4.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

double error(const Options& options, double q, const std::vector<double>& values = {3e-4, 4e-4}) {
  RobotDescription description;
  description.joint_types = {JointType::kRevolute};
  description.motor_ratio = Eigen::VectorXd::Constant(1, -100);
  const RobotModel robot = build_dh(description, one_row(0, 0, 1));
  return std::remainder(heading(tool(with(robot, {{"gear_harmonic", "joint1", values, options}}), posture({q}))) - q,
                        4 * kHalfPi);
}

TEST(GearHarmonic, IsSineAndCosineOfTheOrder) {
  const double peak = std::atan2(3, 4);
  for (const double order : {1.0, 2.0, 2.5, 7.0}) {
    EXPECT_NEAR(error({{"order", order}}, 0), 4e-4, 1e-16);
    EXPECT_NEAR(error({{"order", order}}, kHalfPi / order), 3e-4, 1e-15);
    EXPECT_NEAR(error({{"order", order}}, peak / order), 5e-4, 1e-15);
  }
}

TEST(GearHarmonic, AnEccentricEncoderIsOrderOne) {
  // 10 um beside the axis, a track of 50 mm radius: the reading errs by 1e-2 / 50 rad at most, once a turn.
  EXPECT_NEAR(error({}, kHalfPi, {1e-2 / 50, 0}), 2e-4, 1e-15);
  EXPECT_NEAR(error({}, 3 * kHalfPi, {1e-2 / 50, 0}), -2e-4, 1e-15);
}

TEST(GearHarmonic, AtTheMotorTheRatioMultiplies) {
  const Options twice{{"order", 2.0}, {"side", std::string("motor")}};
  EXPECT_NEAR(error(twice, kHalfPi / 200), 3e-4, 1e-15);
  const Options given{{"side", std::string("motor")}, {"motor_ratio", 50.0}};
  EXPECT_NEAR(error(given, kHalfPi / 50), 3e-4, 1e-15);
}

TEST(GearHarmonic, OrdersOfOneJointHaveNamesOfTheirOwn) {
  EXPECT_EQ(make_effect("gear_harmonic", flat_arm(1), "joint1", {{"order", 2.5}})->parameters()[0].name, "sine_2.5x");
}

TEST(GearHarmonic, RefusesWhatHasNoWave) {
  for (const double order : {0.5, 0.0, -2.0, std::nan("")}) EXPECT_THROW(error({{"order", order}}, 0), InvalidInput);
  EXPECT_THROW(make_effect("gear_harmonic", flat_arm(1), "joint1", {{"side", std::string("motor")}}),
               InvalidInput);  // no ratio known
  EXPECT_THROW(error({{"side", std::string("gear")}}, 0), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
