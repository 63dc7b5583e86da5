// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Random numbers that are the same on every machine (the standard's distributions are not), and counts that shrink
// where FASTCAL_TEST_SHORT=1 is set, as under the sanitizers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>

#include "fastcal/math/se3.hpp"

namespace fastcal::test {

constexpr double kPi = std::numbers::pi;

/// How often to repeat: `full`, or a fiftieth of it in the short form.
inline int repeat(int full) {
  const char* value = std::getenv("FASTCAL_TEST_SHORT");
  return value != nullptr && std::string(value) == "1" ? std::max(1, full / 50) : full;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) * 0x1.0p-53;
  }
  int whole(int low, int high) { return static_cast<int>(std::floor(uniform(low, high + 1))); }
  bool chance(double p) { return uniform(0, 1) < p; }
  /// Box and Muller.
  double normal(double deviation = 1) {
    const double r = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    return deviation * r * std::cos(uniform(0, 2 * kPi));
  }

  Eigen::Vector3d vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Eigen::Vector3d normals(double deviation) { return {normal(deviation), normal(deviation), normal(deviation)}; }
  Eigen::Vector3d unit() { return normals(1).normalized(); }
  /// Uniform over all rotations.
  Eigen::Matrix3d rotation() {
    return Eigen::Quaterniond(normal(), normal(), normal(), normal()).normalized().toRotationMatrix();
  }
  Pose pose(double size) { return {rotation(), vector(size)}; }
  Eigen::VectorXd values(Eigen::Index count, double size) {
    return Eigen::VectorXd::NullaryExpr(count, [&] { return uniform(-size, size); });
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace fastcal::test
