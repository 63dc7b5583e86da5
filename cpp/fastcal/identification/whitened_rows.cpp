// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/whitened_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace fastcal {
namespace {

/// Reads anchors out of theta's tail.
Eigen::Matrix3Xd anchors_of(const Problem& problem, const Eigen::VectorXd& theta) {
  return Eigen::Map<const Eigen::Matrix3Xd>(theta.data() + problem.model.parameter_count(), 3,
                                            problem.measured.anchor_count);
}

}  // namespace

double whitening_deviation(const Problem& problem, const CommonNoise& tau, Eigen::Index i, int component) {
  const double own = problem.measured.sigma(i, component);
  const double common = tau[static_cast<std::size_t>(kind_of(component))];
  return own == 0 ? common : std::sqrt(own * own + common * common);
}

WhitenedRows::WhitenedRows(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                           const Eigen::VectorXd& scale, const CommonNoise& tau)
    : problem_(problem),
      free_(free),
      scale_(scale),
      tau_(tau),
      block_(problem.model, theta.head(problem.model.parameter_count()), free, scale),
      anchors_(anchors_of(problem, theta)) {
  const Measurements& measured = problem.measured;
  const std::array<bool, kKinds> kinds{measured.position.size() > 0, measured.rotation.size() > 0,
                                       measured.distance.size() > 0};
  for (int c = 0; c < kComponents; ++c) {
    if (kinds[static_cast<std::size_t>(kind_of(c))]) numbers_.push_back(c);
  }
  points_only_ = !kinds[1] && !kinds[2];
  if (const LoadResponse* response = problem.response)
    along_ = response->directions.transpose() * (theta - response->origin);
}

void WhitenedRows::evaluate(Eigen::Index begin, Eigen::Index end) {
  begin_ = begin;
  rows_ = static_cast<int>(end - begin);
  block_.forward(problem_.samples, begin, end, problem_.memory);
  const Eigen::Index stride = block_.stride();
  const auto count = static_cast<Eigen::Index>(numbers_.size());
  residual_.resize(count * stride);
  factor_.resize(count * stride);
  slope_.resize(6 * count * stride);
  std::fill(residual_.data(), residual_.data() + count * stride, 0.0);
  std::fill(factor_.data(), factor_.data() + count * stride, 0.0);
  if (!points_only_) std::fill(slope_.data(), slope_.data() + 6 * count * stride, 0.0);
  anchor_.assign(static_cast<std::size_t>(rows_), -1);
  weights_.assign(static_cast<std::size_t>(rows_), {});
  for (int i = 0; i < rows_; ++i) compare(i);
}

double* WhitenedRows::jacobian() {
  const auto p = static_cast<Eigen::Index>(free_.size());
  double* J = J_.resize((p + 1) * ld());
  const int points = problem_.measured.position.size() > 0 ? 3 : 0;
  block_.jacobian({points > 0, static_cast<int>(numbers_.size()) - points, factor_.data(),
                   slope_.data() + 6 * points * block_.stride()},
                  J, ld());
  if (problem_.measured.distance.size() > 0) anchor_columns(J);
  if (along_.size() > 0) response_columns(J);
  Eigen::Map<Eigen::ArrayXd>(J + p * ld(), height()) = Eigen::Map<const Eigen::ArrayXd>(residual_.data(), height()) *
                                                       Eigen::Map<const Eigen::ArrayXd>(factor_.data(), height());
  return J;
}

void WhitenedRows::compare(int i) {
  const Eigen::Index row = begin_ + i;
  if (!points_only_) {
    row_residual(problem_.measured, row, block_.tool(i), &anchors_, row_);
    anchor_[static_cast<std::size_t>(i)] = row_.anchor;
  }
  RowWeight& weight = weights_[static_cast<std::size_t>(i)];
  for (std::size_t n = 0; n < numbers_.size(); ++n) {
    const int c = numbers_[n];
    const bool missing =
        points_only_ ? std::isnan(problem_.measured.position(row, c)) : !row_.present[static_cast<std::size_t>(c)];
    if (missing) continue;
    double r = points_only_ ? block_.position(i, c) - problem_.measured.position(row, c) : row_.r[c];
    for (Eigen::Index k = 0; k < along_.size(); ++k)
      r += problem_.response->change[static_cast<std::size_t>(k)](row, c) * along_[k];
    const double inverse = 1 / whitening_deviation(problem_, tau_, row, c);
    at(residual_, n)[i] = r;
    at(factor_, n)[i] = inverse;
    weight.squared += r * r * inverse * inverse;
    ++weight.components;
    for (int k = 0; !points_only_ && k < 6; ++k)
      slope_.data()[(6 * static_cast<Eigen::Index>(n) + k) * block_.stride() + i] = row_.J_r_tool(c, k);
  }
}

void WhitenedRows::anchor_columns(double* J) {
  const std::size_t n = numbers_.size() - 1;
  const int p = problem_.model.parameter_count();
  for (std::size_t k = 0; k < free_.size(); ++k) {
    if (free_[k] < p) continue;
    double* out = J + static_cast<Eigen::Index>(k) * ld() + static_cast<Eigen::Index>(n) * block_.stride();
    const double* slope = slope_.data() + (6 * static_cast<Eigen::Index>(n) + (free_[k] - p) % 3) * block_.stride();
    for (int i = 0; i < rows_; ++i) {
      if (anchor_[static_cast<std::size_t>(i)] == (free_[k] - p) / 3)
        out[i] = -slope[i] * at(factor_, n)[i] * scale_[static_cast<Eigen::Index>(k)];
    }
  }
}

void WhitenedRows::response_columns(double* J) {
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const Eigen::VectorXd along =
        problem_.response->directions.row(free_[k]).transpose() * scale_[static_cast<Eigen::Index>(k)];
    double* out = J + static_cast<Eigen::Index>(k) * ld();
    for (std::size_t n = 0; n < numbers_.size(); ++n, out += block_.stride()) {
      for (int i = 0; i < rows_; ++i) {
        double sum = 0;
        for (Eigen::Index d = 0; d < along.size(); ++d)
          sum += problem_.response->change[static_cast<std::size_t>(d)](begin_ + i, numbers_[n]) * along[d];
        if (at(factor_, n)[i] != 0) out[i] += sum * at(factor_, n)[i];
      }
    }
  }
}

}  // namespace fastcal
