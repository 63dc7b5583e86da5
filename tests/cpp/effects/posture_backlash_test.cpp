// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A gap by hand: joint 1 rests half of it ahead where joint 2 is beyond 0.2 rad, and half of it behind elsewhere.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

TEST(PostureBacklash, TheOtherJointDecidesTheFlank) {
  const ErrorModel model = with(flat_arm(2), {{"posture_backlash", "joint1<-joint2", {0.01}, {{"at", 0.2}}}});
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.3}))), 0.505 + 0.3, 1e-15);
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.2}))), 0.495 + 0.2, 1e-15);
  EXPECT_NEAR(heading(tool(model, posture({-0.5, -0.3}))), -0.505 - 0.3, 1e-15);
}

TEST(PostureBacklash, JoinsTwoJointsAndTakesOneNumber) {
  for (const char* owner : {"joint1", "joint1<-joint1", "joint1<-joint3"}) {
    EXPECT_THROW(make_effect("posture_backlash", flat_arm(2), owner, {}), InvalidInput) << owner;
  }
  EXPECT_THROW(make_effect("posture_backlash", flat_arm(2), "joint1<-joint2", {{"side", 1.0}}), InvalidInput);
  EXPECT_THROW(make_effect("posture_backlash", flat_arm(2), "joint1<-joint2", {{"at", std::string("middle")}}),
               InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
