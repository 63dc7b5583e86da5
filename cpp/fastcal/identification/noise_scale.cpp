// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/noise_scale.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

namespace fastcal {
namespace {

/// The tau at which a falling function crosses 1, at least `floor`: false position on logarithmic scales, where a plain
/// variance is a straight line, with the Illinois rule (M. Dowell, P. Jarratt 1971).
template <typename F>
double crossing(const F& ratio, double floor, double guess) {
  const auto height = [&](double x) { return std::log(ratio(std::exp(x))); };
  double low = std::log(floor);
  double above = height(low);
  if (!(above > 0)) return floor;
  double high = std::log(std::max(guess, floor) * 2);
  double below = height(high);
  while (below > 0) {
    low = high;
    above = below;
    high += std::log(4.0);
    below = height(high);
  }
  double x = high;
  double y = below;
  for (int i = 0; i < 100 && y != 0; ++i) {
    // Where the function is 0, its logarithm leads nowhere.
    const double next = std::isinf(below) ? 0.5 * (low + high) : high - below * (high - low) / (below - above);
    if (std::abs(next - x) <= 1e-16 * std::abs(x)) break;
    const double there = height(next);
    const bool again = (y > 0) == (there > 0);
    x = next;
    y = there;
    (y > 0 ? low : high) = x;
    (y > 0 ? above : below) = y;
    if (again) (y > 0 ? below : above) *= 0.5;
  }
  return std::exp(x);
}

/// P(chi^2 > x) with d degrees of freedom: Q_1 = erfc(sqrt(x / 2)), Q_2 = exp(-x / 2), Q_d+2 = Q_d + (x / 2)^(d / 2)
/// exp(-x / 2) / Gamma(d / 2 + 1).
double chi_squared_tail(int d, double x) {
  const double half = 0.5 * x;
  double tail = d % 2 ? std::erfc(std::sqrt(half)) : std::exp(-half);
  for (int k = d % 2 ? 1 : 2; k < d; k += 2)
    tail += std::exp(0.5 * k * std::log(half) - half - std::lgamma(0.5 * k + 1));
  return tail;
}

/// The value in the middle of numbers of at least 0, as if they were sorted. Of very many only those that share its
/// leading bits, by which such numbers are sorted too, are copied.
double middle_of(std::span<const double> values) {
  constexpr std::size_t kMany = 100'000;
  constexpr int kShift = 48;
  const auto leading = [](double value) { return std::bit_cast<std::uint64_t>(value) >> kShift; };
  std::size_t before = 0;
  std::vector<double> near;
  if (values.size() < kMany) {
    near.assign(values.begin(), values.end());
  } else {
    std::vector<std::size_t> count(std::size_t{1} << (64 - kShift), 0);
    for (const double value : values) ++count[leading(value)];
    std::size_t bin = 0;
    while (before + count[bin] <= values.size() / 2) before += count[bin++];
    near.reserve(count[bin]);
    for (const double value : values) {
      if (leading(value) == bin) near.push_back(value);
    }
  }
  const auto middle = near.begin() + static_cast<std::ptrdiff_t>(values.size() / 2 - before);
  std::nth_element(near.begin(), middle, near.end());
  return *middle;
}

}  // namespace

double median_noise(const ObservedRows& rows, double floor, double guess) {
  const auto typical = [](int components) {
    const double cube = 1 - 2 / (9.0 * components);
    return components * cube * cube * cube;
  };
  const std::vector<int> counts = rows.counts();
  for (const int d : counts) {
    if (rows.unclaimed(d).size() == rows.count())
      return std::max(floor, std::sqrt(middle_of(rows.unclaimed(d)) / typical(d)));
  }
  std::vector<double> u(rows.count());
  const auto ratio = [&](double tau) {
    auto to = u.begin();
    for (const int d : counts) {
      const double scale = 1 / (typical(d) * tau * tau);
      for (const double square : rows.unclaimed(d)) *to++ = scale * square;
    }
    for (const ObservedRow& row : rows.claiming()) *to++ = row.whitened(tau) / typical(row.components);
    const auto middle = u.begin() + static_cast<std::ptrdiff_t>(u.size() / 2);
    std::nth_element(u.begin(), middle, u.end());
    return *middle;
  };
  if (rows.claiming().empty()) return std::max(floor, std::sqrt(ratio(1.0)));
  return crossing(ratio, floor, guess);
}

double mean_noise(const ObservedRows& rows, LossKind loss, double freedom, double floor, double guess) {
  const LossKind kind = loss == LossKind::kNone ? LossKind::kNone : LossKind::kTukey;
  const std::vector<int> counts = rows.counts();
  double expected = 0;
  for (const int d : counts)
    expected += static_cast<double>(rows.unclaimed(d).size()) * tuned_loss(kind, d).expectation;
  for (const ObservedRow& row : rows.claiming()) expected += tuned_loss(kind, row.components).expectation;
  const auto ratio = [&](double tau) {
    double sum = 0;
    for (const int d : counts) sum += tuned_loss(kind, d).sum(rows.unclaimed(d), 1 / (freedom * tau * tau));
    for (const ObservedRow& row : rows.claiming())
      sum += tuned_loss(kind, row.components).rho(row.whitened(tau) / freedom);
    return sum / expected;
  };
  return crossing(ratio, floor, guess);
}

double outlier_limit(int components, double rows) {
  if (components > kManyNumbers) return components * outlier_limit(kAsMany, rows) / kAsMany;
  constexpr double kShareOfSets = 0.01;
  const double wanted = std::log(kShareOfSets / std::max(rows, 1.0));
  double x = components;  // the mean
  for (int i = 0; i < 60; ++i) {
    const double tail = chi_squared_tail(components, x);
    // d log P / dx = -density / P: P is log-concave from two degrees of freedom on and log-convex for one, so that from
    // the second step on all come from the same side.
    const double log_density =
        (0.5 * components - 1) * std::log(0.5 * x) - 0.5 * x - std::lgamma(0.5 * components) - std::log(2.0);
    const double step = (std::log(tail) - wanted) * tail / std::exp(log_density);
    x = std::max(x + step, 0.5 * x);
    if (std::abs(step) <= 1e-14 * x) break;
  }
  return x;
}

void VarianceInflation::add(const RowWeight& row) {
  if (row.components == 0) return;
  const Loss& rho = tuned_loss(loss_, row.components);
  const double s = row.squared / freedom_;
  const double across = rho.weight(s);
  const double along = across + rho.weight_slope(s);
  slope_ += loss_ == LossKind::kDistance ? across * s : (row.components - 1) * across + along;
  slope_squared_ += (row.components - 1) * across * across + along * along;
  psi_squared_ += across * across * s;
  numbers_ += row.components;
}

void VarianceInflation::add(const VarianceInflation& others) {
  slope_ += others.slope_;
  slope_squared_ += others.slope_squared_;
  psi_squared_ += others.psi_squared_;
  numbers_ += others.numbers_;
}

double VarianceInflation::value() const {
  const double a = slope_ / numbers_;
  const double k = loss_ == LossKind::kDistance ? 1 : 1 + (1 - freedom_) * (slope_squared_ / numbers_ / (a * a) - 1);
  return k * k * psi_squared_ / numbers_ / (a * a);
}

}  // namespace fastcal
