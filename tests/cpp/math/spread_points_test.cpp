// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/spread_points.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

TEST(SpreadPoints, HalveTheLargestGapOfALine) {
  MatrixXd x(9, 1);
  x << 0, 1, 2, 3, 4, 5, 6, 7, 8;
  EXPECT_EQ(spread_points(x, 4, 5, 0), (std::vector<Index>{4, 0, 8, 2, 6}));
}

TEST(SpreadPoints, EachIsAsFarFromThoseBeforeItAsAnyPointIs) {
  std::srand(3);
  const MatrixXd x = MatrixXd::Random(200, 3);
  const std::vector<Index> chosen = spread_points(x, 17, 20, 0);
  ASSERT_EQ(chosen.size(), 20U);
  EXPECT_EQ(chosen[0], 17);
  const auto nearest = [&](Index i, std::size_t count) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k) least = std::min(least, (x.row(i) - x.row(chosen[k])).norm());
    return least;
  };
  for (std::size_t k = 1; k < chosen.size(); ++k)
    for (Index i = 0; i < x.rows(); ++i) EXPECT_LE(nearest(i, k), nearest(chosen[k], k) + 1e-15);
}

TEST(SpreadPoints, EndWhereTheNextIsNear) {
  MatrixXd x(4, 1);
  x << 0, 0.4, 1, 1.5;
  EXPECT_EQ(spread_points(x, 0, 4, 0.6), (std::vector<Index>{0, 3}));
  EXPECT_EQ(spread_points(MatrixXd::Ones(5, 2), 2, 3, 0), std::vector<Index>{2});
}

TEST(SpreadPoints, RefuseWhatIsNoPoint) {
  const MatrixXd x = MatrixXd::Zero(3, 1);
  EXPECT_THROW(spread_points(x, 3, 2, 0), InvalidInput);
  EXPECT_THROW(spread_points(x, -1, 2, 0), InvalidInput);
  EXPECT_THROW(spread_points(x, 0, 0, 0), InvalidInput);
}

}  // namespace
}  // namespace fastcal
