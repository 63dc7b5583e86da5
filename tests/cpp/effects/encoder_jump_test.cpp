// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A jump by hand: joint 2 stands half of it ahead beyond 0.2 rad, and half of it behind before.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

TEST(EncoderJump, TheJointItselfDecides) {
  const ErrorModel model = with(flat_arm(2), {{"encoder_jump", "joint2", {0.01}, {{"at", 0.2}}}});
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.3}))), 0.5 + 0.305, 1e-15);
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.2}))), 0.5 + 0.195, 1e-15);
  EXPECT_NEAR(heading(tool(model, posture({0.1, -0.3}))), 0.1 - 0.305, 1e-15);
}

TEST(EncoderJump, BelongsToOneJointAndTakesOneNumber) {
  for (const char* owner : {"joint3", "joint1<-joint2", "link1"}) {
    EXPECT_THROW(make_effect("encoder_jump", flat_arm(2), owner, {}), InvalidInput) << owner;
  }
  EXPECT_THROW(make_effect("encoder_jump", flat_arm(2), "joint1", {{"side", 1.0}}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
