// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Jacobians written row by row against the columns that twist_columns makes.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "fastcal/kernels/chain_rows.hpp"
#include "fastcal/kernels/streams.hpp"
#include "support/random.hpp"

namespace fastcal {
namespace {

using kernels::FrameTwists;
using kernels::kGroup;
using kernels::kPoseNumbers;
using kernels::TwistRows;

constexpr int kFrames = 3;

/// Rotations and positions of a group of rows.
std::vector<double> random_poses(test::Random& random) {
  std::vector<double> poses(kFrames * kPoseNumbers * kGroup);
  for (int f = 0; f < kFrames; ++f) {
    for (int i = 0; i < kGroup; ++i) {
      const Pose T = random.pose(1.0);
      for (int k = 0; k < kPoseNumbers; ++k)
        poses[static_cast<std::size_t>((f * kPoseNumbers + k) * kGroup + i)] = k < 9 ? T.R(k % 3, k / 3) : T.p[k - 9];
    }
  }
  return poses;
}

/// Shifts and turns of two frames and of the measuring frame, and one that differs by row, as `columns` parameters.
struct Twists {
  explicit Twists(int columns) : rows(kGroup) {
    for (int i = 0; i < kGroup; ++i) rows[static_cast<std::size_t>(i)] = 1.0 + i;
    by_row.terms[0] = {1, false, 2.0, nullptr};
    by_row.terms[1] = {2, true, 0.0, rows.data()};
    int next = 0;
    for (const int frame : {-1, 0, 1}) {
      FrameTwists& here = frames.emplace_back(FrameTwists{frame, {}, &other, 0});
      for (int k = 0; k < 6 && next + 1 < columns; ++k) here.units[k] = {next++, frame + 1, 1.0 + k};
    }
    by_row.column = next;
    frames.back().other_count = 1;
  }
  std::vector<double> rows;
  TwistRows by_row{1, 2, 0, false, 3.0, 2, {}};
  const TwistRows* other = &by_row;
  std::vector<FrameTwists> frames;
};

/// d position / d parameter of every row from twist_columns, and the turn of the tool, where the twists turn it.
double expected(const std::vector<double>& columns, const std::vector<double>& poses, const Twists& twists, int i,
                int n, int k) {
  if (n < 3) return columns[static_cast<std::size_t>((k * 3 + n) * kGroup + i)];
  const auto axis = [&poses, i, n](int frame, int about) {
    if (frame < 0) return about == n - 3 ? 1.0 : 0.0;
    return poses[static_cast<std::size_t>((frame * kPoseNumbers + 3 * about + n - 3) * kGroup + i)];
  };
  if (k == twists.by_row.column) return 3.0 * (1.0 + i) * axis(1, 2);
  for (const FrameTwists& of : twists.frames) {
    for (int about = 0; about < 3; ++about) {
      if (of.units[3 + about].column == k) return of.units[3 + about].size * axis(of.frame, about);
    }
  }
  return 0.0;
}

TEST(ToolJacobians, AreTheColumnsWhereverTheyAreWritten) {
  test::Random random(3);
  const std::vector<double> poses = random_poses(random);
  for (const int columns : {1, 2, 3, 4, 5, 6, 7, 9, 10, 19}) {
    const Twists twists(columns);
    const int twist_count = static_cast<int>(twists.frames.size());
    std::vector<double> factor(3 * kGroup, 1.0), wanted(static_cast<std::size_t>(columns * 3 * kGroup));
    kernels::twist_columns(poses.data(), kFrames, kGroup, twists.frames.data(), twist_count,
                           {kernels::ToolNumbers::kPosition, 0, factor.data(), nullptr, 0}, wanted.data(), 3 * kGroup);
    for (const int numbers : {3, 6}) {
      for (const int rows : {1, 3, 4, 5, 8}) {
        for (int offset = 0; offset < 5; ++offset) {
          std::vector<double> block(static_cast<std::size_t>(columns * numbers * kGroup), 0.0);
          const int count = rows * numbers * columns;
          alignas(64) double to[8 + 8 * 6 * 19];
          std::fill(std::begin(to), std::end(to), -7.0);
          kernels::LineStream out(nullptr, to + offset);
          kernels::tool_jacobians(poses.data(), kFrames, twists.frames.data(), twist_count,
                                  static_cast<kernels::ToolNumbers>(numbers), columns, 0, rows, block.data(), out);
          for (int place = 0; place < static_cast<int>(std::size(to)); ++place) {
            const int at = place - offset;
            if (at < 0 || at >= count) {
              ASSERT_EQ(to[place], -7.0) << "beside " << columns << " columns, " << rows << " rows, from " << offset;
              continue;
            }
            const int i = at / (numbers * columns), n = at / columns % numbers, k = at % columns;
            ASSERT_NEAR(to[place], expected(wanted, poses, twists, i, n, k), 1e-13)
                << "row " << i << ", number " << n << " of " << numbers << ", column " << k << " of " << columns
                << ", from " << offset;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace fastcal
