// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A pull of 1e-3 at 0.5 and 0.4 rad turns joint 1 by 2e-4 rad, and the tool of a flat arm with it.
#include <gtest/gtest.h>

#include "effects/flat.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal::test {
namespace {

TEST(CablePull, TurnsItsJointByTheTwist) {
  const ErrorModel model = with(flat_arm(2), {{"cable_pull", "joint1", {1e-3}, {}}});
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0.4}))), 0.9 + 2e-4, 1e-15);
  EXPECT_NEAR(heading(tool(model, posture({0.5, 0}))), 0.5, 1e-15);
}

TEST(CablePull, NeedsAJointBehindItsOwn) {
  EXPECT_THROW(make_effect("cable_pull", flat_arm(2), "joint2", {}), InvalidInput);
}

}  // namespace
}  // namespace fastcal::test
