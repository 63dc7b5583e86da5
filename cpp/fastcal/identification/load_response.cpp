// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/load_response.hpp"

#include "fastcal/math/decompositions.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

constexpr double kWeak = 1;                  // singular value: a deviation of one plausible size
constexpr double kNullSingularRatio = 1e-9;  // of the largest: the data do not determine it, however loads move
constexpr double kStep =
    1;  // plausible sizes: a difference over less is rounding, of 1e-9 standard deviations in the end

}  // namespace

std::vector<RowMatrixXd> load_changes(const Problem& problem, const Eigen::VectorXd& theta,
                                      const Eigen::MatrixXd& steps) {
  Samples samples = problem.samples;  // one for all settled states: they fill the same memory
  const auto following = [&](const Eigen::VectorXd& there) {
    settle(problem.model, there.head(problem.model.parameter_count()), problem.threads, samples);
    return residuals({problem.model, samples, problem.measured, problem.threads}, there);
  };
  std::vector<RowMatrixXd> out;
  for (const auto& step : steps.colwise()) {
    const Eigen::VectorXd ahead = theta + step, back = theta - step;
    RowMatrixXd change = following(ahead) - following(back);
    change -= residuals(problem, ahead) - residuals(problem, back);
    out.emplace_back(change / (2 * kStep));
  }
  return out;
}

std::optional<LoadResponse> load_response(const Problem& problem, const Eigen::VectorXd& theta,
                                          const std::vector<int>& free, const Eigen::VectorXd& scale,
                                          const Eigen::MatrixXd& factor) {
  if (free.empty()) return std::nullopt;
  const RightSvd svd = right_svd(factor);
  const Eigen::VectorXd& s = svd.values;
  LoadResponse out{theta, {}, theta, {}, {}, {}};
  for (Eigen::Index k = 0; k < s.size(); ++k) {
    if (s[k] >= kWeak || s[k] <= kNullSingularRatio * s[0]) continue;
    Eigen::VectorXd along = Eigen::VectorXd::Zero(theta.size());  // y = along^T (theta - origin), in plausible sizes
    Eigen::VectorXd step = along;
    for (Eigen::Index i = 0; i < scale.size(); ++i) {
      along[free[static_cast<std::size_t>(i)]] = svd.V(i, k) / scale[i];
      step[free[static_cast<std::size_t>(i)]] = kStep * svd.V(i, k) * scale[i];
    }
    for (auto* columns : {&out.directions, &out.steps}) columns->conservativeResize(theta.size(), columns->cols() + 1);
    out.directions.rightCols(1) = along;
    out.steps.rightCols(1) = step;
  }
  if (out.steps.cols() == 0) return std::nullopt;
  const Problem here{problem.model, problem.samples, problem.measured, problem.threads, nullptr, problem.memory};
  out.change = load_changes(here, theta, out.steps);
  return out;
}

void keep_changes(const Problem& problem, LoadResponse& response) {
  constexpr Eigen::Index kMostNumbers = 16 << 20;  // 128 MB
  const auto count = static_cast<Eigen::Index>(response.change.size());
  const Eigen::Index numbers = problem.measured.number_count();
  if (problem.source == nullptr || problem.row_count() * numbers * count > kMostNumbers) return;
  std::vector<RowMatrixXd> all(response.change.size(), RowMatrixXd(problem.row_count(), numbers));
  each_part(problem, [&](const Problem& part, Eigen::Index first) {
    for (std::size_t k = 0; k < all.size(); ++k) all[k].middleRows(first, part.row_count()) = part.response->change[k];
  });
  response.of_source = std::move(all);
}

}  // namespace fastcal
