// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/aligned_numbers.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

namespace fastcal {
namespace {

constexpr Eigen::Index kMegabyte = (1 << 20) / 8;  // numbers

TEST(AlignedNumbers, AreAlignedOfAnySizeAndStayWhileTheyAreEnough) {
  AlignedNumbers numbers;
  EXPECT_EQ(numbers.data(), nullptr);
  for (const Eigen::Index count : {Eigen::Index{1}, Eigen::Index{8}, Eigen::Index{1000}, 3 * kMegabyte}) {
    double* first = numbers.resize(count);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(first) % 64, 0U);
    first[0] = first[count - 1] = 1;  // there, as the address sanitizer sees
    EXPECT_EQ(numbers.resize(count / 2), first);
  }
}

TEST(AlignedNumbers, NoTwoInUseShareAnything) {
  std::vector<AlignedNumbers> several(20);
  for (int round = 0; round < 3; ++round) {
    for (std::size_t k = 0; k < several.size(); ++k) {
      several[k] = AlignedNumbers();
      double* numbers = several[k].resize(static_cast<Eigen::Index>(100 + 10 * k));
      for (std::size_t i = 0; i < 100 + 10 * k; ++i) numbers[i] = static_cast<double>(k);
    }
    for (std::size_t k = 0; k < several.size(); ++k) {
      for (std::size_t i = 0; i < 100 + 10 * k; ++i) ASSERT_EQ(several[k].data()[i], static_cast<double>(k));
    }
  }
}

TEST(AlignedNumbers, MoveAndMayEndOnAnotherThread) {
  AlignedNumbers numbers;
  const double* first = numbers.resize(500);
  AlignedNumbers moved(std::move(numbers));
  EXPECT_EQ(moved.data(), first);
  std::thread([taken = std::move(moved)]() mutable { AlignedNumbers ends(std::move(taken)); }).join();
  EXPECT_NE(AlignedNumbers().resize(500), nullptr);
}

}  // namespace
}  // namespace fastcal
