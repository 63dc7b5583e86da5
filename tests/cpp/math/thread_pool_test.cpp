// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/thread_pool.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "fastcal/math/parallel.hpp"

namespace fastcal {
namespace {

/// Do so many threads come together in the body of one call?
bool meet(int threads) {
  std::atomic<int> here{0};
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  run_together(threads - 1, [&] {
    ++here;
    while (here < threads && std::chrono::steady_clock::now() < until) std::this_thread::yield();
  });
  return here == threads;
}

TEST(ThreadPool, ManyThreadsWorkOnOneCallAndOnTheNext) {
  EXPECT_TRUE(meet(2));
  EXPECT_TRUE(meet(5));
  EXPECT_TRUE(meet(3));
}

TEST(ThreadPool, AllThatBeganHasEnded) {
  for (int round = 0; round < 2000; ++round) {
    std::atomic<int> begun{0}, ended{0};
    run_together(3, [&] {
      ++begun;
      ++ended;
    });
    ASSERT_EQ(begun, ended);
    ASSERT_GE(ended, 1);
    ASSERT_LE(ended, 4);
  }
}

TEST(ThreadPool, EachUnitIsWorkedOnOnceWhileOthersCallToo) {
  std::atomic<int> wrong{0};
  std::vector<std::thread> callers;
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&wrong] {
      for (int round = 0; round < 50; ++round) {
        std::vector<int> seen(1000);
        parallel_units(
            1000, 3, [] { return 0; }, [&](int, Eigen::Index unit) { ++seen[static_cast<std::size_t>(unit)]; });
        for (const int times : seen) wrong += times != 1;
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
}

TEST(ThreadPool, ACallWithinACallRunsToItsEnd) {
  std::atomic<int> sum{0};
  parallel_units(
      8, 2, [] { return 0; },
      [&](int, Eigen::Index) {
        parallel_units(
            8, 2, [] { return 0; }, [&](int, Eigen::Index unit) { sum += static_cast<int>(unit); });
      });
  EXPECT_EQ(sum, 8 * 28);
}

TEST(ThreadPool, AnExceptionReachesTheCallerAndTheNextCallWorks) {
  const auto fail = [](int, Eigen::Index unit) {
    if (unit == 700) throw std::runtime_error("unit 700");
  };
  EXPECT_THROW(parallel_units(
                   1000, 4, [] { return 0; }, fail),
               std::runtime_error);
  EXPECT_TRUE(meet(4));
}

#if !defined(__SANITIZE_THREAD__)  // which lets no thread begin behind a fork
TEST(ThreadPool, AForkHasThreadsOfItsOwn) {
  ASSERT_TRUE(meet(3));
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) _exit(meet(3) ? 0 : 1);
  int status = 1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_TRUE(meet(3));
}
#endif

}  // namespace
}  // namespace fastcal
