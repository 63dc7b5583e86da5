// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/elimination.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace fastcal::beam {
namespace {

TEST(Elimination, AChainHasNoFill) {
  std::vector<std::pair<int, int>> edges;
  for (int i = 0; i < 30; ++i) edges.emplace_back((7 * i) % 31, (7 * (i + 1)) % 31);
  std::vector<bool> held(31, false);
  held[0] = true;
  const Elimination plan = plan_elimination(edges, held);
  EXPECT_EQ(plan.free_count, 30);
  EXPECT_EQ(plan.position[0], -1);
  EXPECT_EQ(plan.block_count(), 30 + 29);
}

TEST(Elimination, AParallelogramInAChainCostsOneBlockMore) {
  const std::vector<std::pair<int, int>> edges = {{0, 1}, {1, 2}, {2, 3}, {2, 4}, {4, 5}, {3, 5}, {5, 6}, {6, 7}};
  const Elimination plan = plan_elimination(edges, std::vector<bool>(8, false));
  EXPECT_EQ(plan.block_count(), 8 + 8 + 1);
}

/// The pattern holds all of L, and the updates are those of elimination by columns: done on numbers, they factorize.
TEST(Elimination, ItsUpdatesFactorizeARandomGraph) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 12;
    std::vector<std::pair<int, int>> edges;
    for (int i = 0; i < 18; ++i) edges.emplace_back(random() % n, random() % n);
    std::erase_if(edges, [](const auto& edge) { return edge.first == edge.second; });
    const Elimination plan = plan_elimination(edges, std::vector<bool>(n, false));
    Eigen::MatrixXd K = Eigen::MatrixXd::Identity(n, n) * 40;
    for (const auto& [a, b] : edges) K(plan.position[a], plan.position[b]) = K(plan.position[b], plan.position[a]) = -1;
    std::vector<double> block(static_cast<std::size_t>(plan.block_count()), 0.0);
    for (int c = 0; c < n; ++c) {
      block[static_cast<std::size_t>(c)] = K(c, c);
      for (int s = plan.slot_begin[c]; s < plan.slot_begin[c + 1]; ++s) block[n + s] = K(plan.slot_row[s], c);
    }
    std::size_t next = 0;
    Eigen::MatrixXd L = Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd diagonal(n);
    for (int c = 0; c < n; ++c) {
      diagonal[c] = block[static_cast<std::size_t>(c)];
      for (int i = plan.slot_begin[c]; i < plan.slot_begin[c + 1]; ++i) {
        L(plan.slot_row[i], c) = block[n + i] / diagonal[c];
        for (int j = plan.slot_begin[c]; j <= i; ++j)
          block[plan.update[next++]] -= block[n + i] * block[n + j] / diagonal[c];
      }
    }
    EXPECT_EQ(next, plan.update.size());
    EXPECT_LT((L * diagonal.asDiagonal() * L.transpose() - K).cwiseAbs().maxCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace fastcal::beam
