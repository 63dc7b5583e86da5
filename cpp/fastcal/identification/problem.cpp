// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/whitened_rows.hpp"
#include "fastcal/kernels/normal_sums.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {
namespace {

/// By the count of numbers in a row.
std::vector<const Loss*> losses(LossKind kind, int most) {
  std::vector<const Loss*> out{nullptr};
  for (int d = 1; d <= most; ++d) out.push_back(&tuned_loss(kind, d));
  return out;
}

}  // namespace

int Problem::workers() const {
  constexpr Eigen::Index kWorthAThread = 1024;  // rows
  return static_cast<int>(std::clamp<Eigen::Index>(row_count() / kWorthAThread, 1, std::max(threads, 1)));
}

void Problem::check() const {
  samples.check(model.robot().joint_count());
  FASTCAL_CHECK(measured.rows() == samples.count())
      << "there are " << samples.count() << " rows of conditions and " << measured.rows() << " of measurements";
  FASTCAL_CHECK(measured.number_count() > 0) << "nothing was measured";
  FASTCAL_CHECK(samples.count() > 0) << "there are no rows";
}

NormalEquations normal_equations(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                 const Eigen::VectorXd& scale, const Weighting& weighting, bool with_jacobian) {
  const auto p = static_cast<Eigen::Index>(free.size());
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  NormalEquations sum;
  double weight = 0;
  double slope = 0;
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(p + 1, p + 1);
  // Groups of chunks bound the memory; within a group the chunks are summed in their order, whoever worked on them.
  constexpr Eigen::Index kGroupChunks = 128;
  for (Eigen::Index first = 0; first < problem.row_count(); first += kGroupChunks * kChunkRows) {
    const Eigen::Index rows = std::min(problem.row_count() - first, kGroupChunks * kChunkRows);
    std::vector<Eigen::MatrixXd> parts(static_cast<std::size_t>(chunk_count(rows)));
    std::vector<double> costs(parts.size(), 0.0), weights(costs), slopes(costs);
    const auto worker = [&] { return WhitenedRows(problem, theta, free, scale, weighting.tau); };
    parallel_chunks(rows, problem.workers(), worker,
                    [&](WhitenedRows& whitened, Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
                      const auto c = static_cast<std::size_t>(chunk);
                      whitened.evaluate(first + begin, first + end);
                      for (int i = 0; i < end - begin; ++i) {
                        const RowWeight& row = whitened.weight(i);
                        if (row.components == 0) continue;
                        const Loss& rho = *loss[row.components];
                        costs[c] += 0.5 * rho.rho(row.squared);
                        if (!with_jacobian) continue;
                        const double weight = rho.weight(row.squared);
                        if (weight != 1) whitened.weigh(i, std::sqrt(weight));
                        weights[c] += row.components * weight;
                        slopes[c] += rho.weight_slope(row.squared);
                      }
                      if (!with_jacobian) return;
                      parts[c] = Eigen::MatrixXd::Zero(p + 1, p + 1);
                      kernels::gram(whitened.jacobian(), whitened.ld(), whitened.height(), static_cast<int>(p) + 1,
                                    parts[c].data());
                    });
    for (std::size_t c = 0; c < parts.size(); ++c) {
      sum.cost += costs[c];
      weight += weights[c];
      slope += slopes[c];
      if (with_jacobian) total += parts[c];
    }
  }
  if (with_jacobian) {
    sum.A = total.topLeftCorner(p, p).selfadjointView<Eigen::Upper>();
    sum.g = total.topRightCorner(p, 1);
    constexpr double kFlattest = 0.3;  // of what rejects so much, no quadratic shows where it ends
    if (weight > 0) sum.bend = std::clamp(1 + slope / weight, kFlattest, 1.0);
  }
  return sum;
}

RowMatrixXd residuals(const Problem& problem, const Eigen::VectorXd& theta) {
  RowMatrixXd out = RowMatrixXd::Constant(problem.row_count(), problem.measured.number_count(),
                                          std::numeric_limits<double>::quiet_NaN());
  const std::vector<int> none;
  const Eigen::VectorXd scale;
  const CommonNoise one(problem.measured.observations().size(), 1.0);
  const auto worker = [&] { return WhitenedRows(problem, theta, none, scale, one); };
  parallel_chunks(problem.row_count(), problem.workers(), worker,
                  [&](WhitenedRows& rows, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
                    rows.evaluate(begin, end);
                    for (Eigen::Index i = begin; i < end; ++i) rows.raw(static_cast<int>(i - begin), out.row(i));
                  });
  return out;
}

std::vector<RowWeight> row_weights(const Problem& problem, const RowMatrixXd& residuals, const Weighting& weighting) {
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  std::vector<RowWeight> out(static_cast<std::size_t>(residuals.rows()));
  for (Eigen::Index i = 0; i < residuals.rows(); ++i) {
    RowWeight& row = out[static_cast<std::size_t>(i)];
    for (int c = 0; c < problem.measured.number_count(); ++c) {
      if (std::isnan(residuals(i, c))) continue;
      const double u = residuals(i, c) / whitening_deviation(problem, weighting.tau, i, c);
      row.squared += u * u;
      ++row.components;
    }
    row.weight = row.components == 0 ? 0 : loss[row.components]->weight(row.squared);
  }
  return out;
}

Eigen::MatrixXd triangular_factor(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                  const Eigen::VectorXd& scale, const CommonNoise& tau,
                                  const std::vector<RowWeight>* rows) {
  const auto p = static_cast<Eigen::Index>(free.size());
  std::vector<Eigen::MatrixXd> factors(static_cast<std::size_t>(chunk_count(problem.row_count())));
  const auto worker = [&] { return WhitenedRows(problem, theta, free, scale, tau); };
  parallel_chunks(problem.row_count(), problem.workers(), worker,
                  [&](WhitenedRows& whitened, Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
                    whitened.evaluate(begin, end);
                    for (Eigen::Index i = begin; rows != nullptr && i < end; ++i) {
                      if (!((*rows)[static_cast<std::size_t>(i)].weight > 0))
                        whitened.weigh(static_cast<int>(i - begin), 0);
                    }
                    constexpr int kRows = 128;  // their columns stay in the first-level cache
                    Eigen::MatrixXd& R = factors[static_cast<std::size_t>(chunk)] = Eigen::MatrixXd::Zero(p, p);
                    double* J = whitened.jacobian();
                    for (int from = 0; from < whitened.height(); from += kRows) {
                      kernels::update_triangle(J + from, whitened.ld(), std::min(kRows, whitened.height() - from),
                                               static_cast<int>(p), R.data());
                    }
                  });
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(p, p);
  const Eigen::Index rows_of_factor = (p + kernels::kGroup - 1) / kernels::kGroup * kernels::kGroup;
  Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(rows_of_factor, p);
  for (const Eigen::MatrixXd& factor : factors) {
    padded.topRows(p) = factor;
    padded.bottomRows(rows_of_factor - p).setZero();
    kernels::update_triangle(padded.data(), static_cast<int>(rows_of_factor), static_cast<int>(rows_of_factor),
                             static_cast<int>(p), R.data());
  }
  return R;
}

}  // namespace fastcal
