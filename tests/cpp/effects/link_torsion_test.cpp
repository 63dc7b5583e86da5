// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A link of 1 m, GJ = 1e5 N m^2, with 20 kg that hang 0.25 m beside its axis: 49.03325 N m twist it by 4.903325e-4 rad.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"

namespace fastcal::test {
namespace {

TEST(LinkTorsion, TurnsTheFarEndAboutTheLink) {
  RobotDescription description = level_description();
  description.p_flange_payload = {0, 0, 0.25};  // along the joint's axis, which is level
  const ErrorModel model =
      with(level_arm(description), {{"link_torsion", "link1", {1e-5}, {}}}).with_equilibrium(false);
  const Twists xi = twists(model, posture({0}, 20));
  // y is up: the weight (0, -F, 0) at (0, 0, l) has the moment (+F l, 0, 0).
  EXPECT_TRUE(xi.col(link_frame(0)).isApprox((Vector6d() << 0, 0, 0, 4.903325e-4, 0, 0).finished(), 1e-13));
  EXPECT_NEAR(twists(model, posture({kHalfPi}, 20)).norm(), 0, 1e-18);  // upright, the weight twists nothing
}

}  // namespace
}  // namespace fastcal::test
