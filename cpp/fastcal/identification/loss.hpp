// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Robust losses on the whitened error u = |r_i| of a whole row: cost = 1/2 sum rho(u^2).
// Tuned to 95 % efficiency at the normal law for every number of components d of a row, so that d = 3 is not treated as
// d = 1. Source: R. Maronna, D. Martin, V. Yohai, "Robust Statistics" (2006), chapters 2, 5 and 6.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace fastcal {

enum class LossKind {
  kNone,
  kHuber,
  kCauchy,
  kTukey,
  kDistance  ///< rho = 2 u: the sum of the distances themselves, the cost that the PMC paper prints in (15); not tuned
};
inline constexpr std::size_t kLossKinds = static_cast<std::size_t>(LossKind::kDistance) + 1;  // the last of them

/// "none", "huber", "cauchy" or "tukey"; throws InvalidInput for another.
LossKind loss_kind(const std::string& name);

/// Its inverse; "distance" for the distance.
std::string loss_name(LossKind kind);

/// Rows of more numbers than kManyNumbers are judged by the mean of their squares, as if they held kAsMany: the corners
/// of a picture err together where the arm is not where the model has it, and a row is no outlier because its many
/// numbers prove that.
inline constexpr int kManyNumbers = 32;
inline constexpr int kAsMany = 6;

/// A loss for rows of d components.
struct Loss {
  LossKind kind = LossKind::kNone;
  double tuning = 0;       ///< k, c
  double consistency = 1;  ///< E[w(u) u^2] / d at the normal law
  double expectation = 0;  ///< E[rho(u^2)] at the normal law: both make a scale unbiased there
  double share = 1;        ///< rho(s) is that of share * s, over share: kAsMany / d of rows of very many numbers

  double rho(double s) const;  ///< s = u^2
  /// sum rho(factor q) over many q.
  double sum(std::span<const double> q, double factor) const;
  double weight(double s) const;        ///< w = d rho / d s
  double weight_slope(double s) const;  ///< u dw/du, at u^2 = s
  Loss as_many() const;                 ///< the one of which it takes the share
};

/// The tuned loss for rows of `components` numbers, 1 to kMostNumbers.
const Loss& tuned_loss(LossKind kind, int components);

/// The tuned losses by the count of numbers in a row, 1 to `most`; null for 0.
std::vector<const Loss*> losses(LossKind kind, int most);

}  // namespace fastcal
