// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A gap of 1 mrad: half a milliradian to the side of the approach, or of the load: the level arm's own weight is
// -49.03325 N m.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

TEST(Backlash, LiesOnTheFlankOfTheApproach) {
  const ErrorModel model = with(flat_arm(2), {{"backlash", "joint2", {1e-3}, {}}});
  for (const double side : {1.0, -1.0, 0.0}) {
    Samples samples = posture({0.3, 0.4});
    samples.approach = RowMatrixXd::Zero(1, 2);
    samples.approach(0, 1) = side;
    EXPECT_NEAR(heading(tool(model, samples)), 0.7 + side * 5e-4, 1e-15);
  }
  EXPECT_NEAR(heading(tool(model, posture({0.3, 0.4}))), 0.7, 1e-15);  // nothing is known of the approach
}

TEST(Backlash, LiesOnTheFlankOfTheLoad) {
  const auto turn = [](double width, double q) {
    return twists(with(level_arm(), {{"backlash", "joint1", {1e-3}, {{"side", std::string("load")}, {"width", width}}}})
                      .with_equilibrium(false),
                  posture({q}))(5, joint_frame(0));
  };
  EXPECT_NEAR(turn(1, 0), -5e-4, 1e-18);
  EXPECT_NEAR(turn(49.03325, 0), -5e-4 * std::tanh(1), 1e-18);
  EXPECT_NEAR(turn(1, 2 * kHalfPi), 5e-4, 1e-18);  // turned over
  EXPECT_NEAR(turn(1, kHalfPi), 0, 1e-17);         // upright: no load, in the middle
}

TEST(Backlash, RefusesAWidthThatIsNone) {
  EXPECT_THROW(make_effect("backlash", level_arm(), "joint1", {{"width", 0.0}}), InvalidInput);
  EXPECT_THROW(make_effect("backlash", level_arm(), "joint1", {{"side", std::string("left")}}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
