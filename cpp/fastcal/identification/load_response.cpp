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

/// r(theta + step) - r(theta - step), with loads that follow or loads that are constant.
RowMatrixXd difference(const Problem& problem, const Eigen::VectorXd& theta, const Eigen::VectorXd& step, bool follow) {
  const auto at = [&](const Eigen::VectorXd& there) {
    if (!follow) return residuals(problem, there);
    Samples samples = problem.samples;
    settle(problem.model, there.head(problem.model.parameter_count()), problem.threads, samples);
    return residuals({problem.model, samples, problem.measured, problem.threads}, there);
  };
  return at(theta + step) - at(theta - step);
}

}  // namespace

std::vector<RowMatrixXd> load_changes(const Problem& problem, const Eigen::VectorXd& theta,
                                      const Eigen::MatrixXd& steps) {
  std::vector<RowMatrixXd> out;
  for (const auto& step : steps.colwise())
    out.emplace_back((difference(problem, theta, step, true) - difference(problem, theta, step, false)) / (2 * kStep));
  return out;
}

std::optional<LoadResponse> load_response(const Problem& problem, const Eigen::VectorXd& theta,
                                          const std::vector<int>& free, const Eigen::VectorXd& scale,
                                          const Eigen::MatrixXd& factor) {
  if (free.empty()) return std::nullopt;
  const RightSvd svd = right_svd(factor);
  const Eigen::VectorXd& s = svd.values;
  LoadResponse out{theta, {}, theta, {}, {}};
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

}  // namespace fastcal
