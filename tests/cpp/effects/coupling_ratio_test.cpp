// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Gears by hand: joint 1 turns by 0.5 * 1.01 = 0.505 rad, of which joint 2 takes up 2 %.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

TEST(CouplingRatio, FollowsTheOutputOfTheSource) {
  const ErrorModel model =
      with(flat_arm(2), {{"coupling_ratio", "joint2<-joint1", {0.02}, {}}, {"reduction_ratio", "joint1", {0.01}, {}}});
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.3}))), 0.505 + 0.3 + 0.02 * 0.505, 1e-15);
}

TEST(CouplingRatio, IsNotItsOwnReverse) {
  const ErrorModel model = with(flat_arm(2), {{"coupling_ratio", "joint1<-joint2", {0.02}, {}}});
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.3}))), 0.8 + 0.02 * 0.3, 1e-15);
}

TEST(CouplingRatio, JoinsTwoJointsOfTheArm) {
  for (const char* owner : {"joint1", "joint1<-joint1", "joint1<-joint3", "joint0<-joint1"}) {
    EXPECT_THROW(make_effect("coupling_ratio", flat_arm(2), owner, {}), InvalidInput) << owner;
  }
}

}  // namespace
}  // namespace fastcal::test
