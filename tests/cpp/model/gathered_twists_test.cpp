// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/gathered_twists.hpp"

#include <gtest/gtest.h>

namespace fastcal {
namespace {

using kernels::FrameRows;
using kernels::FrameTwists;
using kernels::TwistRows;

TwistRows twist(int frame, int column, int part) {
  TwistRows out{frame, frame + 1, column, false, 2.0, 0, {}};
  add_term(part, 1.5, nullptr, out);
  return out;
}

/// Frames that all turn about z by row and are shifted along it.
std::vector<FrameRows> chain(int frames) {
  FrameRows row{};
  row.constant[11] = 0.3;
  row.constant_turn = kernels::Turn::kNone;
  return std::vector<FrameRows>(static_cast<std::size_t>(frames), row);
}

FrameTwists only_frame(const GatheredTwists& gathered) {
  EXPECT_EQ(gathered.count(), 1);
  return gathered.frames().front();
}

TEST(GatheredTwists, LookAtATurnAboutZPastTheJoint) {
  GatheredTwists gathered;
  std::vector<bool> unmoved(3, true);
  std::vector<TwistRows> geometry{twist(0, 0, 5), twist(1, 2, 0), twist(0, 1, 2)};
  put_in_order(geometry, unmoved);
  gathered.gather(geometry, {}, chain(3), 3);
  const FrameTwists here = only_frame(gathered);
  EXPECT_EQ(here.frame, 1);
  EXPECT_EQ(here.other_count, 0);
  EXPECT_EQ(here.units[5].column, 0);
  EXPECT_EQ(here.units[5].first_moved, 1);
  EXPECT_EQ(here.units[5].size, 3.0);
  EXPECT_EQ(here.units[2].column, 1);
  EXPECT_EQ(here.units[0].column, 2);
  EXPECT_EQ(here.units[0].first_moved, 2);
}

TEST(GatheredTwists, StayWhereTheAxisIsLost) {
  for (int kind = 0; kind < 4; ++kind) {
    std::vector<FrameRows> frames = chain(3);
    const double motion = 0;
    if (kind == 0) frames[1].motion = &motion;
    if (kind == 1) frames[1].constant[9] = 0.1;
    if (kind == 2) frames[1].constant_turn = kernels::Turn::kAboutX;
    std::vector<bool> unmoved(1, true);
    std::vector<TwistRows> geometry{twist(kind == 3 ? 2 : 0, 0, 5)};  // the last frame has none behind it
    put_in_order(geometry, unmoved);
    GatheredTwists gathered;
    gathered.gather(geometry, {}, frames, 1);
    EXPECT_EQ(only_frame(gathered).frame, kind == 3 ? 2 : 0) << kind;
  }
}

TEST(GatheredTwists, BeginASumBeforeTheyAddToIt) {
  std::vector<bool> unmoved(1, true);
  std::vector<TwistRows> geometry{twist(0, 0, 5), twist(0, 0, 5), twist(0, 0, 0)};
  put_in_order(geometry, unmoved);
  GatheredTwists gathered;
  gathered.gather(geometry, {}, chain(3), 1);
  const FrameTwists here = only_frame(gathered);
  EXPECT_EQ(here.frame, 0);
  EXPECT_EQ(here.units[5].column, 0);
  ASSERT_EQ(here.other_count, 2);
  EXPECT_TRUE(here.others[0]->adds);
  EXPECT_TRUE(here.others[1]->adds);
}

TEST(GatheredTwists, OfOneAxisHaveOneUnit) {
  std::vector<bool> unmoved(2, true);
  std::vector<TwistRows> geometry{twist(2, 0, 4), twist(2, 1, 4)};
  put_in_order(geometry, unmoved);
  GatheredTwists gathered;
  gathered.gather(geometry, {}, chain(3), 2);
  const FrameTwists here = only_frame(gathered);
  EXPECT_EQ(here.units[4].column, 0);
  ASSERT_EQ(here.other_count, 1);
  EXPECT_EQ(here.others[0]->column, 1);
}

}  // namespace
}  // namespace fastcal
