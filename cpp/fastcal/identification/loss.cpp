// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/loss.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "fastcal/math/check.hpp"
#include "fastcal/measurement/measurements.hpp"

namespace fastcal {
namespace {

constexpr double kEfficiency = 0.95;

/// E[f(u^2)] where u^2 is chi-squared with d degrees of freedom, by Simpson's rule over u in [0, 14].
template <typename F>
double expectation(int d, const F& f) {
  constexpr int kSteps = 1400;
  constexpr double kEnd = 14;
  const double h = kEnd / kSteps;
  const double log_norm = (0.5 * d - 1) * std::log(2.0) + std::lgamma(0.5 * d);
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = i * h;
    const double density =
        (u > 0 ? std::exp((d - 1) * std::log(u) - 0.5 * u * u - log_norm) : (d == 1 ? std::exp(-log_norm) : 0.0));
    sum += (i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2) * density * f(u * u);
  }
  return sum * h / 3;
}

/// Asymptotic efficiency at the normal law: A^2 / B, A = E[div psi] / d = E[w u^2] / d (C. Stein 1981), B = E[w^2 u^2]
/// / d. In its second form A has no jump at Huber's corner, on which Simpson's rule loses three digits.
double efficiency(const Loss& loss, int d) {
  const double a = expectation(d, [&](double s) { return loss.weight(s) * s; }) / d;
  const double b = expectation(d, [&](double s) { return loss.weight(s) * loss.weight(s) * s; }) / d;
  return a * a / b;
}

Loss tune(LossKind kind, int d) {
  Loss loss;
  loss.kind = kind;
  loss.expectation = d;
  if (kind == LossKind::kNone || kind == LossKind::kDistance) return loss;
  double low = 0.3;
  double high = 30;
  for (int i = 0; i < 40; ++i) {
    loss.tuning = std::sqrt(low * high);
    (efficiency(loss, d) < kEfficiency ? low : high) = loss.tuning;
  }
  loss.consistency = expectation(d, [&](double s) { return loss.weight(s) * s; }) / d;
  loss.expectation = expectation(d, [&](double s) { return loss.rho(s); });
  return loss;
}

}  // namespace

LossKind loss_kind(const std::string& name) {
  if (name == "none") return LossKind::kNone;
  if (name == "huber") return LossKind::kHuber;
  if (name == "cauchy") return LossKind::kCauchy;
  FASTCAL_CHECK(name == "tukey") << "the loss must be none, huber, cauchy or tukey, got '" << name << "'";
  return LossKind::kTukey;
}

std::string loss_name(LossKind kind) {
  switch (kind) {
    case LossKind::kHuber:
      return "huber";
    case LossKind::kCauchy:
      return "cauchy";
    case LossKind::kTukey:
      return "tukey";
    case LossKind::kDistance:
      return "distance";
    default:
      return "none";
  }
}

double Loss::rho(double s) const {
  const double c2 = tuning * tuning;
  switch (kind) {
    case LossKind::kHuber:
      return s <= c2 ? s : 2 * tuning * std::sqrt(s) - c2;
    case LossKind::kCauchy:
      return c2 * std::log1p(s / c2);
    case LossKind::kTukey: {
      const double left = s < c2 ? 1 - s / c2 : 0;
      return c2 / 3 * (1 - left * left * left);
    }
    case LossKind::kDistance:
      return 2 * std::sqrt(s);
    default:
      return s;
  }
}

double Loss::weight(double s) const {
  const double t = tuning > 0 ? s / (tuning * tuning) : 0;
  switch (kind) {
    case LossKind::kHuber:
      return t <= 1 ? 1 : 1 / std::sqrt(t);
    case LossKind::kCauchy:
      return 1 / (1 + t);
    case LossKind::kTukey:
      return t < 1 ? (1 - t) * (1 - t) : 0;
    case LossKind::kDistance:
      return 1 / std::sqrt(std::max(s, 1e-30));
    default:
      return 1;
  }
}

double Loss::weight_slope(double s) const {
  const double t = tuning > 0 ? s / (tuning * tuning) : 0;
  switch (kind) {
    case LossKind::kHuber:
      return t <= 1 ? 0 : -1 / std::sqrt(t);
    case LossKind::kCauchy:
      return -2 * t / ((1 + t) * (1 + t));
    case LossKind::kTukey:
      return t < 1 ? -4 * t * (1 - t) : 0;
    case LossKind::kDistance:
      return -weight(s);
    default:
      return 0;
  }
}

const Loss& tuned_loss(LossKind kind, int components) {
  FASTCAL_CHECK(components >= 1 && components <= kMostNumbers)
      << "a row has 1 to " << kMostNumbers << " components, got " << components;
  struct Slot {
    std::once_flag once;
    Loss loss;
  };
  static std::array<std::array<Slot, kMostNumbers + 1>, kLossKinds> slots;
  Slot& slot = slots.at(static_cast<std::size_t>(kind)).at(static_cast<std::size_t>(components));
  std::call_once(slot.once, [&] { slot.loss = tune(kind, components); });
  return slot.loss;
}

}  // namespace fastcal
