// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A disturbed arm, what is measured of it, and what its identification must always be.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/identify.hpp"
#include "support/simulation.hpp"

namespace fastcal::test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A disturbed arm and its data.
struct Scene {
  ErrorModel model;
  Samples samples;
  Measured measured;
  Eigen::VectorXd truth;
  What what = What::kPositions;

  Identification identified(const IdentifyOptions& options = {}, int threads = 1) const {
    return identify({model, samples, measured, threads}, asked(model, what), Eigen::VectorXd(), options);
  }
};

inline Scene scene(std::uint64_t seed, What what, Eigen::Index rows, const Noise& noise, double error = 5e-4,
                   double angle = 0) {
  Random random(seed);
  Scene s{ErrorModel(build("dh", six_axes(angle))), postures(random, rows, 6), {}, {}, what};
  s.truth = disturbed(random, s.model, error);
  s.measured = measure(random, s.model, s.samples, s.truth, what, noise);
  return s;
}

inline IdentifyOptions with(LossKind loss) {
  IdentifyOptions options;
  options.loss = loss;
  return options;
}

inline bool is_free(const Identification& result, int parameter) {
  return std::find(result.free.begin(), result.free.end(), parameter) != result.free.end();
}

inline void expect_finite(const Identification& result) {
  EXPECT_TRUE(result.theta.allFinite());
  EXPECT_TRUE(result.covariance.allFinite());
  EXPECT_EQ(result.covariance.rows(), static_cast<Eigen::Index>(result.free.size()));
  for (const double value : result.tau) EXPECT_TRUE(std::isfinite(value));
  for (const double value : result.sigma) EXPECT_TRUE(std::isfinite(value));
  EXPECT_TRUE(std::isfinite(result.variance_factor));
  for (const RowWeight& row : result.weights) EXPECT_TRUE(std::isfinite(row.weight) && std::isfinite(row.squared));
}

}  // namespace fastcal::test
