// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Copies past the caches put every number where it belongs, and none beside it.
#include "fastcal/kernels/streams.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <vector>

namespace fastcal {
namespace {

TEST(CopyPastCaches, CopiesAnyCountToAnyPlace) {
  std::vector<double> from(1100);
  std::iota(from.begin(), from.end(), 1.0);
  for (const int offset : {0, 1, 2, 3, 5, 7, 8}) {
    for (const int count : {0, 1, 2, 3, 8, 17, 1001}) {
      std::vector<double> to(1100, -1.0);
      kernels::copy_past_caches(from.data() + 1, count, to.data() + offset);
      for (int k = 0; k < 1100; ++k) {
        const bool inside = k >= offset && k < offset + count;
        ASSERT_EQ(to[k], inside ? from[k - offset + 1] : -1.0) << offset << ", " << count << ": " << k;
      }
    }
  }
}

TEST(LineStream, WritesPartsAsOneArray) {
  alignas(64) double lines[99 + kernels::kLine];
  for (const auto& [offset, buffer] :
       {std::pair(0, lines), {1, lines}, {2, lines}, {5, lines}, {8, lines}, std::pair<int, double*>(3, nullptr)}) {
    for (const int part : {1, 3, 8, 21, 99}) {
      alignas(64) double to[1100];
      std::fill(std::begin(to), std::end(to), -1.0);
      kernels::LineStream stream(buffer, to + offset);
      const int parts = 1000 / part;
      for (int k = 0; k < parts; ++k) {
        std::iota(stream.room(), stream.room() + part, k * part + 1.0);
        stream.write(part);
      }
      stream.finish();
      for (int k = 0; k < 1100; ++k) {
        const bool inside = k >= offset && k < offset + parts * part;
        ASSERT_EQ(to[k], inside ? k - offset + 1.0 : -1.0) << offset << ", " << part << ": " << k;
      }
    }
  }
}

TEST(CopyPastCaches, IsForArraysThatNoCoreHolds) {
  EXPECT_FALSE(kernels::is_beyond_caches(100'000));
  EXPECT_TRUE(kernels::is_beyond_caches(12'600'000));
}

}  // namespace
}  // namespace fastcal
