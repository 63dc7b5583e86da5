// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/loss.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/measurement/measurements.hpp"

namespace fastcal {
namespace {

constexpr double kEfficiency = 0.95;

/// E[f(u^2)] where u^2 is chi-squared with d degrees of freedom, by Simpson's rule where it is.
template <typename F>
double expectation(int d, const F& f) {
  constexpr int kSteps = 1400;
  constexpr double kEnd = 14;
  constexpr double kFar = 8;  // from the root of d, about which u lies with a standard deviation of 0.7
  const double first = std::max(0.0, std::sqrt(d) - kFar);
  const double h = (std::max(kEnd, std::sqrt(d) + kFar) - first) / kSteps;
  const double log_norm = (0.5 * d - 1) * std::log(2.0) + std::lgamma(0.5 * d);
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = first + i * h;
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

/// What tune() gives for the rows that nearly all files hold; it takes longer than a fit to fifty of them.
constexpr struct {
  LossKind kind;
  int components;
  double tuning, consistency, expectation;
} kTuned[] = {
    {LossKind::kHuber, 1, 1.3449909865546754, 0.82137002746977172, 0.93258350543913793},
    {LossKind::kHuber, 2, 1.501135530406621, 0.80131333263843985, 1.8534574209451549},
    {LossKind::kHuber, 3, 1.6279985268767128, 0.78140956367875691, 2.760243994044481},
    {LossKind::kHuber, 4, 1.7310952605199461, 0.76066564460232611, 3.649063165751075},
    {LossKind::kHuber, 5, 1.8120317315144152, 0.73808227434849494, 4.5136361976552166},
    {LossKind::kHuber, 6, 1.8693743572734947, 0.71233118707652565, 5.343243381242794},
    {LossKind::kCauchy, 1, 2.3849471193537166, 0.69738447032113271, 0.82282731683987131},
    {LossKind::kCauchy, 2, 2.5486376268862445, 0.65746526404889172, 1.5951290438108998},
    {LossKind::kCauchy, 3, 2.6655683445814504, 0.62241599801474357, 2.323649632309019},
    {LossKind::kCauchy, 4, 2.7515811351995243, 0.59080737650958348, 3.0123198770081587},
    {LossKind::kCauchy, 5, 2.8154034765803098, 0.56179537742692898, 3.6636794603235927},
    {LossKind::kCauchy, 6, 2.8623720281948013, 0.53483258530571176, 4.2794609714778247},
    {LossKind::kTukey, 1, 4.6850649484217879, 0.75778177158084181, 0.87370247421211555},
    {LossKind::kTukey, 2, 5.1229860938381409, 0.73002274318756311, 1.7184086576571642},
    {LossKind::kTukey, 3, 5.4902492084235233, 0.70676727187752819, 2.5408905010487621},
    {LossKind::kTukey, 4, 5.8103155871171746, 0.68666278467858033, 3.3452486609822789},
    {LossKind::kTukey, 5, 6.0962664688606276, 0.66890863180905835, 4.1342611568057306},
    {LossKind::kTukey, 6, 6.3562162897177146, 0.6529861386039103, 4.9099472653446172},
};

Loss tuned(LossKind kind, int d) {
  for (const auto& known : kTuned) {
    if (known.kind == kind && known.components == d) return {kind, known.tuning, known.consistency, known.expectation};
  }
  if (d <= kManyNumbers || kind == LossKind::kNone || kind == LossKind::kDistance) return tune(kind, d);
  Loss loss = tuned(kind, kAsMany);
  loss.share = static_cast<double>(kAsMany) / d;
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

Loss Loss::as_many() const {
  Loss out = *this;
  out.share = 1;
  return out;
}

double Loss::rho(double s) const {
  if (share != 1) return as_many().rho(share * s) / share;
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

double Loss::sum(std::span<const double> q, double factor) const {
  if (share != 1) return as_many().sum(q, share * factor) / share;
  const Eigen::Map<const Eigen::ArrayXd, Eigen::Unaligned> squares(q.data(), static_cast<Eigen::Index>(q.size()));
  if (kind == LossKind::kNone) return factor * squares.sum();
  if (kind == LossKind::kTukey) {
    const double c2 = tuning * tuning;
    return c2 / 3 * (1 - (1 - factor / c2 * squares).max(0.0).cube()).sum();
  }
  double out = 0;
  for (const double square : q) out += rho(factor * square);
  return out;
}

double Loss::weight(double s) const {
  s *= share;
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
  s *= share;
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
  static std::array<std::array<Slot, kManyNumbers + 1>, kLossKinds> slots;
  if (components <= kManyNumbers) {
    Slot& slot = slots.at(static_cast<std::size_t>(kind)).at(static_cast<std::size_t>(components));
    std::call_once(slot.once, [&] { slot.loss = tuned(kind, components); });
    return slot.loss;
  }
  static std::mutex mutex;
  static std::map<std::pair<LossKind, int>, Loss> many;  // whose places do not move
  const std::lock_guard<std::mutex> lock(mutex);
  const auto found = many.find({kind, components});
  return found != many.end() ? found->second
                             : many.emplace(std::pair(kind, components), tuned(kind, components)).first->second;
}

std::vector<const Loss*> losses(LossKind kind, int most) {
  std::vector<const Loss*> out{nullptr};
  for (int d = 1; d <= most; ++d) out.push_back(&tuned_loss(kind, d));
  return out;
}

}  // namespace fastcal
