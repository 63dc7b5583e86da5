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

/// Squared lengths of all rows, unweighted.
std::vector<RowWeight> whitened_lengths(const Problem& problem, const RowMatrixXd& residuals, const CommonNoise& tau) {
  std::vector<RowWeight> out(static_cast<std::size_t>(residuals.rows()));
  const bool claims = problem.measured.claims_sigma();
  const int numbers = problem.measured.number_count();
  std::vector<double> inverse(static_cast<std::size_t>(numbers));
  for (int c = 0; c < numbers; ++c) inverse[c] = 1 / tau[problem.measured.observation_of(c)];
  parallel_chunks(residuals.rows(), problem.workers(), [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index i = begin; i < end; ++i) {
      RowWeight& row = out[static_cast<std::size_t>(i)];
      for (int c = 0; c < numbers; ++c) {
        const double r = residuals(i, c);
        if (std::isnan(r)) continue;
        const double u = r * (claims ? 1 / whitening_deviation(problem, tau, i, c) : inverse[c]);
        row.squared += u * u;
        ++row.components;
      }
    }
  });
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
  const bool flattens = with_jacobian && weighting.loss != LossKind::kNone;
  NormalEquations sum;
  if (flattens) sum.flattening = Eigen::MatrixXd::Zero(p, p);
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(p + 1, p + 1);
  // Groups of chunks bound the memory; within a group the chunks are summed in their order, whoever worked on them.
  constexpr Eigen::Index kGroupChunks = 128;
  for (Eigen::Index first = 0; first < problem.row_count(); first += kGroupChunks * kChunkRows) {
    const Eigen::Index rows = std::min(problem.row_count() - first, kGroupChunks * kChunkRows);
    std::vector<Eigen::MatrixXd> parts(static_cast<std::size_t>(chunk_count(rows)));
    std::vector<Eigen::MatrixXd> flat(flattens ? parts.size() : 0);
    std::vector<double> costs(parts.size(), 0.0);
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
                        if (flattens) whitened.flatten(i, weight, -rho.weight_slope(row.squared));
                      }
                      if (!with_jacobian) return;
                      const double* J = whitened.jacobian();
                      parts[c] = Eigen::MatrixXd::Zero(p + 1, p + 1);
                      kernels::gram(J, whitened.ld(), whitened.height(), static_cast<int>(p) + 1, parts[c].data());
                      if (!flattens || !whitened.is_flattened()) return;
                      flat[c] = Eigen::MatrixXd::Zero(p, p);
                      kernels::gram(whitened.along_residuals(J), whitened.ld(), whitened.stride(), static_cast<int>(p),
                                    flat[c].data());
                    });
    for (std::size_t c = 0; c < parts.size(); ++c) {
      sum.cost += costs[c];
      if (with_jacobian) total += parts[c];
      if (flattens && flat[c].size() > 0) sum.flattening += flat[c];
    }
  }
  if (with_jacobian) {
    sum.A = total.topLeftCorner(p, p).selfadjointView<Eigen::Upper>();
    sum.g = total.topRightCorner(p, 1);
    if (flattens) sum.flattening.triangularView<Eigen::StrictlyLower>() = sum.flattening.transpose();
  }
  return sum;
}

double cost_of(const Problem& problem, const RowMatrixXd& residuals, const Weighting& weighting) {
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  double cost = 0;
  for (const RowWeight& row : whitened_lengths(problem, residuals, weighting.tau)) {
    if (row.components > 0) cost += 0.5 * loss[row.components]->rho(row.squared);
  }
  return cost;
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
  std::vector<RowWeight> out = whitened_lengths(problem, residuals, weighting.tau);
  for (RowWeight& row : out) row.weight = row.components == 0 ? 0 : loss[row.components]->weight(row.squared);
  return out;
}

PlainSums plain_sums(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& columns,
                     const Eigen::VectorXd& scale, const Weighting& weighting, Eigen::Index last,
                     const Eigen::MatrixXd& directions) {
  constexpr Eigen::Index kGroupRows = 128 * kChunkRows;
  const auto p = static_cast<Eigen::Index>(columns.size());
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(last + 1, last + 1);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(directions.cols());
  for (Eigen::Index first = 0; first < problem.row_count(); first += kGroupRows) {
    const Eigen::Index rows = std::min(problem.row_count() - first, kGroupRows);
    std::vector<Eigen::MatrixXd> parts(static_cast<std::size_t>(chunk_count(rows)));
    std::vector<Eigen::VectorXd> along(parts.size());
    const auto worker = [&] { return WhitenedRows(problem, theta, columns, scale, weighting.tau); };
    parallel_chunks(rows, problem.workers(), worker,
                    [&](WhitenedRows& whitened, Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
                      const auto c = static_cast<std::size_t>(chunk);
                      whitened.evaluate(first + begin, first + end);
                      double* J = whitened.jacobian();
                      const Eigen::OuterStride<> apart(whitened.ld());
                      const int height = whitened.height();
                      const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> all(J, height, p, apart);
                      along[c].resize(directions.cols());
                      for (Eigen::Index d = 0; d < directions.cols(); ++d)
                        along[c][d] = (all * directions.col(d)).squaredNorm();
                      Eigen::Map<Eigen::VectorXd>(J + p * whitened.ld(), height) = whitened.weighted_residuals(loss);
                      parts[c] = Eigen::MatrixXd::Zero(last + 1, last + 1);
                      kernels::gram(J + (p - last) * whitened.ld(), whitened.ld(), height, static_cast<int>(last) + 1,
                                    parts[c].data());
                    });
    for (std::size_t c = 0; c < parts.size(); ++c) {
      total += parts[c];
      squares += along[c];
    }
  }
  PlainSums out;
  out.A = total.topLeftCorner(last, last).selfadjointView<Eigen::Upper>();
  out.g = total.topRightCorner(last, 1);
  if (squares.size() > 0) out.along = squares.maxCoeff();
  return out;
}

Eigen::MatrixXd triangular_factor(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                  const Eigen::VectorXd& scale, const Weighting& weighting, Eigen::VectorXd* g) {
  constexpr Eigen::Index kUnitRows = 4 * kChunkRows;  // that share a triangle: adding one to the others costs 40 rows
  constexpr Eigen::Index kGroupRows = 64 * kUnitRows;
  constexpr int kCachedRows = 128;  // their columns stay in the first-level cache
  const auto p = static_cast<Eigen::Index>(free.size());
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(p, p);
  if (g != nullptr) *g = Eigen::VectorXd::Zero(p);
  const Eigen::Index rows_of_factor = (p + kernels::kGroup - 1) / kernels::kGroup * kernels::kGroup;
  Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(rows_of_factor, p);

  const auto add_rows = [&](WhitenedRows& whitened, Eigen::Index begin, Eigen::Index end, Eigen::MatrixXd& factor,
                            Eigen::VectorXd& slope) {
    whitened.evaluate(begin, end);
    double* J = whitened.jacobian();
    if (g != nullptr) {
      const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> columns(J, whitened.height(), p,
                                                                               Eigen::OuterStride<>(whitened.ld()));
      slope += columns.transpose() * whitened.weighted_residuals(loss);
    }
    for (int from = 0; from < whitened.height(); from += kCachedRows) {
      kernels::update_triangle(J + from, whitened.ld(), std::min(kCachedRows, whitened.height() - from),
                               static_cast<int>(p), factor.data());
    }
  };
  for (Eigen::Index first = 0; first < problem.row_count(); first += kGroupRows) {
    const Eigen::Index end = std::min(problem.row_count(), first + kGroupRows);
    const auto units = static_cast<std::size_t>((end - first + kUnitRows - 1) / kUnitRows);
    std::vector<Eigen::MatrixXd> factors(units, Eigen::MatrixXd::Zero(p, p));
    std::vector<Eigen::VectorXd> slopes(units, Eigen::VectorXd::Zero(p));
    const auto worker = [&] { return WhitenedRows(problem, theta, free, scale, weighting.tau); };
    parallel_units(static_cast<Eigen::Index>(units), problem.workers(), worker,
                   [&](WhitenedRows& whitened, Eigen::Index unit) {
                     const Eigen::Index last = std::min(end, first + (unit + 1) * kUnitRows);
                     for (Eigen::Index begin = first + unit * kUnitRows; begin < last; begin += kChunkRows) {
                       add_rows(whitened, begin, std::min(last, begin + kChunkRows),
                                factors[static_cast<std::size_t>(unit)], slopes[static_cast<std::size_t>(unit)]);
                     }
                   });
    for (std::size_t unit = 0; unit < units; ++unit) {
      if (g != nullptr) *g += slopes[unit];
      if (first == 0 && unit == 0) {
        R = factors[unit];
        continue;
      }
      padded.topRows(p) = factors[unit];
      padded.bottomRows(rows_of_factor - p).setZero();
      kernels::update_triangle(padded.data(), static_cast<int>(rows_of_factor), static_cast<int>(rows_of_factor),
                               static_cast<int>(p), R.data());
    }
  }
  return R;
}

}  // namespace fastcal
