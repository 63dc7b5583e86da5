// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A profile over -1 ... 1 rad: its first curve is the straight line sqrt(3) q; at the ends it fades over 5 degrees.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

constexpr double kFade = 5 * 3.14159265358979323846 / 180;

double error(double q, int curve, double size,
             const Options& options = {{"low", -1.0}, {"high", 1.0}, {"knots", 8.0}}) {
  const RobotModel robot = flat_arm(1);
  std::vector<double> values(make_effect("joint_profile", robot, "joint1", options)->parameters().size(), 0.0);
  values[static_cast<std::size_t>(curve)] = size;
  return twists(with(robot, {{"joint_profile", "joint1", values, options}}), posture({q}))(5, joint_frame(0));
}

TEST(JointProfile, ItsFirstCurveIsAStraightLine) {
  for (const double q : {-1.0, -0.3, 0.0, 0.77, 1.0})
    EXPECT_NEAR(error(q, 0, 1e-3), 1e-3 * std::sqrt(3) * q, 1e-12) << q;
}

TEST(JointProfile, FadesSmoothlyOutsideItsRange) {
  const double edge = error(1, 0, 1);
  const double half = std::sqrt(3) * (1 + kFade / 2) / 2;  // the line goes on; the window is one half in the middle
  EXPECT_NEAR(error(1 + kFade / 2, 0, 1), half, 1e-9);
  EXPECT_NEAR(error(1 + kFade, 0, 1), 0, 1e-12);
  EXPECT_NEAR(error(-1 - kFade, 0, 1), 0, 1e-12);
  EXPECT_EQ(error(3, 0, 1), 0);
  const double h = 1e-6;
  for (int curve : {0, 1, 4}) {
    for (const double side : {1.0, -1.0}) {
      const double inside = (error(side, curve, 1) - error(side * (1 - h), curve, 1)) / h;
      const double outside = (error(side * (1 + h), curve, 1) - error(side, curve, 1)) / h;
      EXPECT_NEAR(inside, outside, 1e-3 * (1 + std::abs(inside))) << curve;  // no kink where it was fitted
    }
    const double last = error(1 + kFade * (1 - 1e-4), curve, 1);
    EXPECT_LT(std::abs(last), 1e-9 * std::max(1.0, std::abs(edge)) * 100) << curve;  // none where it ends
  }
}

TEST(JointProfile, APeriodicOneHasNoEnds) {
  const Options turn{{"periodic", 1.0}, {"knots", 12.0}};
  for (int curve : {0, 1, 5}) EXPECT_NEAR(error(0.4, curve, 1, turn), error(0.4 - 4 * kHalfPi, curve, 1, turn), 1e-12);
  EXPECT_NE(error(3.5, 0, 1, turn), 0);
}

TEST(JointProfile, KnotsAreSpacedWhereNotGiven) {
  const auto count = [](const Options& options) {
    return make_effect("joint_profile", flat_arm(1), "joint1", options)->parameters().size();
  };
  EXPECT_EQ(count({{"low", 0.0}, {"high", 0.1}}), 8 + 2);
  EXPECT_EQ(count({{"low", 0.0}, {"high", 9.5 * kFade * 4 / 5}}), 10 + 2);
  EXPECT_EQ(count({}), 48 + 2);
}

TEST(JointProfile, RefusesARangeThatIsNone) {
  for (const Options& options : std::vector<Options>{
           {{"low", 1.0}, {"high", 1.0}}, {{"knots", 3.0}}, {{"knots", 7.5}}, {{"low", std::nan("")}}}) {
    EXPECT_THROW(make_effect("joint_profile", flat_arm(1), "joint1", options), InvalidInput);
  }
}

}  // namespace
}  // namespace fastcal::test
