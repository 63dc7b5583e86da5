// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Compliance from motor currents: 12.5 A at 2e-5 rad/A turn the joint by 2.5e-4 rad, whatever hangs on it.
#include <gtest/gtest.h>

#include "effects/loaded.hpp"

namespace fastcal::test {
namespace {

TEST(CurrentCompliance, TurnsTheJointByItsCurrent) {
  const ErrorModel model = with(level_arm(), {{"current_compliance", "joint1", {-2e-5}, {}}});
  Samples samples = posture({0.3}, 50);
  samples.current = RowMatrixXd::Constant(1, 1, 12.5);
  const Pose T = tool(model, samples);
  EXPECT_NEAR(std::atan2(T.p.z(), T.p.x()), 0.3 - 2.5e-4, 1e-15);
  EXPECT_EQ(model.effects()[0]->data_columns(), std::vector<std::string>{"current1"});
}

}  // namespace
}  // namespace fastcal::test
