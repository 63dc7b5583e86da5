// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Segments and boxes against densely sampled points, and a path through points on a line.
#include "fastcal/design/surroundings.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fastcal/design/route.hpp"

namespace fastcal::design {
namespace {

constexpr int kSteps = 400;

TEST(Surroundings, SegmentsAreAsFarApartAsTheirNearestPoints) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto point = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector3d a = point(), b = point(), c = point(), d = trial % 5 == 0 ? c : point();
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kSteps; ++i) {
      const Eigen::Vector3d p = a + (b - a) * i / kSteps;
      for (int j = 0; j <= kSteps; j += 4) least = std::min(least, (p - c - (d - c) * j / kSteps).norm());
    }
    const double found = segment_distance(a, b, c, d);
    EXPECT_LE(found, least + 1e-12);
    EXPECT_GE(found, least - 0.02);  // of a grid so wide
  }
}

TEST(Surroundings, ASegmentMeetsABoxWhereOneOfItsPointsLiesInIt) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-2, 2);
  const Box box{{-0.5, -0.4, -0.3}, {0.6, 0.7, 0.8}};
  int hits = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector3d a(uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d b = trial % 7 == 0 ? Eigen::Vector3d(a.x(), a.y(), uniform(random))
                                             : Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    bool sampled = false;
    bool nearly = false;
    for (int i = 0; i <= kSteps; ++i) {
      const Eigen::Vector3d p = a + (b - a) * i / kSteps;
      const auto within = [&](double margin) {
        return ((p - box.low).array() >= -margin).all() && ((box.high - p).array() >= -margin).all();
      };
      sampled = sampled || within(0.1);
      nearly = nearly || within(0.1 + 0.02);
    }
    EXPECT_GE(meets(box, a, b, 0.1), sampled);
    EXPECT_LE(meets(box, a, b, 0.1), nearly);
    hits += sampled;
  }
  EXPECT_GT(hits, 20);
  EXPECT_LT(hits, 280);
}

TEST(Route, PointsOnALineAreVisitedFromEndToEnd) {
  RowMatrixXd q(6, 2);
  q << 4, 0, 1, 0, 5, 0, 2, 0, 6, 0, 3, 0;
  const Eigen::VectorXd from = Eigen::VectorXd::Zero(2);
  const std::vector<Eigen::Index> order = visiting_order(q, from);
  EXPECT_EQ(order, (std::vector<Eigen::Index>{1, 3, 5, 0, 2, 4}));
  EXPECT_DOUBLE_EQ(path_length(q, from, order), 6);
}

TEST(Route, OneSweepToEachSideIsShorterThanAZigzag) {
  RowMatrixXd q(5, 1);
  q << 1, -1.1, 3.2, -5, 9;
  const Eigen::VectorXd from = Eigen::VectorXd::Zero(1);
  const std::vector<Eigen::Index> zigzag = {0, 1, 2, 3, 4};
  EXPECT_LE(path_length(q, from, visiting_order(q, from)), 19.0);  // -1.1, -5, then up to 9
  EXPECT_GT(path_length(q, from, zigzag), 19.0);
}

}  // namespace
}  // namespace fastcal::design
