// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "fastcal/identification/load_response.hpp"
#include "fastcal/identification/whitened_rows.hpp"
#include "fastcal/kernels/normal_sums.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

/// How many sums of so many numbers are kept until they are added up: few threads are started for many rows, and the
/// memory does not grow with them.
Eigen::Index group_size(Eigen::Index numbers) {
  constexpr Eigen::Index kNumbers = 2'000'000;
  return std::clamp<Eigen::Index>(kNumbers / std::max<Eigen::Index>(numbers, 1), 16, 4096);
}

constexpr Eigen::Index kUnitRows = 4 * kChunkRows;  // that share a triangle, which costs 40 rows to add

/// Rows that share their sums: more where there are many, so that fewer sums are kept until they are added up. Parts of
/// rows that are read one by one are whole multiples.
Eigen::Index sum_rows(Eigen::Index rows) {
  const Eigen::Index chunks = chunk_count(rows);
  return kChunkRows * (chunks > 256 ? 16 : chunks > 64 ? 4 : 1);
}

/// Calls add(sums) for the sums of every unit of rows in their order, to which evaluate(rows, count, sums) has added
/// chunk by chunk, whatever thread worked on it; `numbers` are how many the sums of a unit hold.
template <typename Sums, typename Evaluate, typename Add>
void sum_chunks(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& columns,
                const Eigen::VectorXd& scale, const CommonNoise& tau, Eigen::Index numbers, const Evaluate& evaluate,
                const Add& add) {
  const Eigen::Index unit_rows = sum_rows(problem.row_count()), group = group_size(numbers) * unit_rows;
  const Eigen::Index at_once = rows_at_once(problem.measured.number_count());
  each_part(problem, [&](const Problem& part, Eigen::Index) {
    const auto worker = [&] { return WhitenedRows(part, theta, columns, scale, tau); };
    for (Eigen::Index first = 0; first < part.row_count(); first += group) {
      const Eigen::Index end = std::min(part.row_count(), first + group);
      std::vector<Sums> sums(static_cast<std::size_t>((end - first + unit_rows - 1) / unit_rows));
      parallel_units(static_cast<Eigen::Index>(sums.size()), part.workers(), worker,
                     [&](WhitenedRows& whitened, Eigen::Index unit) {
                       Sums here;  // apart from those that other threads write
                       const Eigen::Index last = std::min(end, first + (unit + 1) * unit_rows);
                       for (Eigen::Index begin = first + unit * unit_rows; begin < last; begin += at_once) {
                         const Eigen::Index stop = std::min(last, begin + at_once);
                         whitened.evaluate(begin, stop);
                         evaluate(whitened, static_cast<int>(stop - begin), here);
                       }
                       sums[static_cast<std::size_t>(unit)] = std::move(here);
                     });
      for (const Sums& of_unit : sums) add(of_unit);
    }
  });
}

}  // namespace

Part::Part(const Problem& whole, Eigen::Index begin, Eigen::Index end)
    : whole_(whole), rows_(whole.source->read(begin, end)) {
  if (whole.settled_at == nullptr) return;
  settled_ = *rows_.samples;
  settle(whole.model, whole.settled_at->head(whole.model.parameter_count()), whole.threads, settled_);
  if (whole.response == nullptr) return;
  const LoadResponse& all = *whole.response;
  response_ = {all.origin, all.directions, all.found_at, all.steps, {}, {}};
  for (const RowMatrixXd& change : all.of_source) response_.change.emplace_back(change.middleRows(begin, end - begin));
  if (!all.of_source.empty()) return;
  response_.change = load_changes({whole.model, settled_, *rows_.measured, whole.threads}, all.found_at, all.steps);
}

Problem Part::problem() const {
  return {whole_.model, whole_.settled_at == nullptr ? *rows_.samples : settled_, *rows_.measured, whole_.threads,
          whole_.response == nullptr ? nullptr : &response_};
}

int Problem::workers() const {
  constexpr Eigen::Index kWorthAThread = 1024;  // rows
  return static_cast<int>(std::clamp<Eigen::Index>(row_count() / kWorthAThread, 1, std::max(threads, 1)));
}

void Problem::check() const {
  samples.check(model.robot().tree());
  FASTCAL_CHECK(measured.rows() == samples.count())
      << "there are " << samples.count() << " rows of conditions and " << measured.rows() << " of measurements";
  FASTCAL_CHECK(measured.number_count() > 0) << "nothing was measured";
  FASTCAL_CHECK(samples.count() > 0) << "there are no rows";
}

NormalEquations normal_equations(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                 const Eigen::VectorXd& scale, const Weighting& weighting, bool with_jacobian) {
  const auto p = static_cast<Eigen::Index>(free.size());
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  const bool flattens = with_jacobian && weighting.loss != LossKind::kNone && weighting.is_curved;
  NormalEquations sum;
  if (flattens) sum.flattening = Eigen::MatrixXd::Zero(p, p);
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(p + 1, p + 1);
  struct Sums {
    Eigen::MatrixXd total, flat;
    double cost = 0;
  };
  const auto evaluate = [&](WhitenedRows& whitened, int rows, Sums& sums) {
    for (int i = 0; i < rows; ++i) {
      const RowWeight& row = whitened.weight(i);
      if (row.components == 0) continue;
      const Loss& rho = *loss[row.components];
      sums.cost += 0.5 * rho.rho(row.squared);
      if (!with_jacobian) continue;
      const double weight = rho.weight(row.squared);
      if (weight != 1) whitened.weigh(i, std::sqrt(weight));
      if (flattens) whitened.flatten(i, weight, -rho.weight_slope(row.squared));
    }
    if (!with_jacobian) return;
    const double* J = whitened.jacobian();
    if (sums.total.size() == 0) sums.total = Eigen::MatrixXd::Zero(p + 1, p + 1);
    for (const WhitenedRows::Part& part : whitened.parts()) {
      kernels::add_gram(J + whitened.place(0, part.first), whitened.ld(), (part.end - part.first) * whitened.stride(),
                        part.columns.data(), static_cast<int>(part.columns.size()), static_cast<int>(p) + 1,
                        sums.total.data());
    }
    if (!flattens || !whitened.is_flattened()) return;
    if (sums.flat.size() == 0) sums.flat = Eigen::MatrixXd::Zero(p, p);
    kernels::add_gram(whitened.along_residuals(J), whitened.ld(), whitened.stride(), static_cast<int>(p),
                      sums.flat.data());
  };
  sum_chunks<Sums>(problem, theta, free, scale, weighting.tau, (flattens ? 2 : 1) * p * p, evaluate,
                   [&](const Sums& of_unit) {
                     sum.cost += of_unit.cost;
                     if (with_jacobian) total += of_unit.total;
                     if (of_unit.flat.size() > 0) sum.flattening += of_unit.flat;
                   });
  if (with_jacobian) {
    sum.A = total.topLeftCorner(p, p).selfadjointView<Eigen::Upper>();
    sum.g = total.topRightCorner(p, 1);
    if (flattens) sum.flattening.triangularView<Eigen::StrictlyLower>() = sum.flattening.transpose();
  }
  return sum;
}

RowMatrixXd residuals(const Problem& problem, const Eigen::VectorXd& theta) {
  RowMatrixXd out(problem.row_count(), problem.measured.number_count());
  const std::vector<int> none;
  const Eigen::VectorXd scale;
  const CommonNoise one(problem.measured.observations().size(), 1.0);
  const auto worker = [&] { return WhitenedRows(problem, theta, none, scale, one); };
  parallel_chunks(problem.row_count(), problem.workers(), worker,
                  [&](WhitenedRows& rows, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
                    rows.evaluate(begin, end);
                    out.middleRows(begin, end - begin).setConstant(std::numeric_limits<double>::quiet_NaN());
                    for (Eigen::Index i = begin; i < end; ++i) rows.raw(static_cast<int>(i - begin), out.row(i));
                  });
  return out;
}

PlainSums plain_sums(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& columns,
                     const Eigen::VectorXd& scale, const Weighting& weighting, Eigen::Index last,
                     const Eigen::MatrixXd& directions) {
  const auto p = static_cast<Eigen::Index>(columns.size());
  const auto loss = losses(weighting.loss, problem.measured.number_count());
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(last + 1, last + 1);
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  struct Sums {
    Eigen::MatrixXd total;
    Eigen::Vector2d along = Eigen::Vector2d::Zero();
  };
  const auto evaluate = [&](WhitenedRows& whitened, int, Sums& sums) {
    double* J = whitened.jacobian();
    const int height = whitened.height();
    if (directions.size() > 0) {
      kernels::add_squares_along(J, whitened.ld(), height, static_cast<int>(p), directions.col(0).data(),
                                 directions.col(1).data(), sums.along.data());
    }
    Eigen::Map<Eigen::VectorXd>(J + p * whitened.ld(), height) = whitened.weighted_residuals(loss);
    if (sums.total.size() == 0) sums.total = Eigen::MatrixXd::Zero(last + 1, last + 1);
    kernels::add_gram(J + (p - last) * whitened.ld(), whitened.ld(), height, static_cast<int>(last) + 1,
                      sums.total.data());
  };
  sum_chunks<Sums>(problem, theta, columns, scale, weighting.tau, last * last, evaluate, [&](const Sums& of_unit) {
    total += of_unit.total;
    squares += of_unit.along;
  });
  PlainSums out;
  out.A = total.topLeftCorner(last, last).selfadjointView<Eigen::Upper>();
  out.g = total.topRightCorner(last, 1);
  out.along = squares.maxCoeff();
  return out;
}

Eigen::MatrixXd triangular_factor(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                  const Eigen::VectorXd& scale, const Weighting& weighting, Eigen::VectorXd* g) {
  constexpr int kCachedRows = 128;  // their columns stay in the first-level cache
  const auto p = static_cast<Eigen::Index>(free.size());
  const Eigen::Index group = group_size(p * p) * kUnitRows;
  const Eigen::Index at_once = rows_at_once(problem.measured.number_count());
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
  bool is_first = true;
  const auto add = [&](const Eigen::MatrixXd& factor) {
    if (is_first) {
      R = factor;
      is_first = false;
      return;
    }
    padded.topRows(p) = factor;
    padded.bottomRows(rows_of_factor - p).setZero();
    kernels::update_triangle(padded.data(), static_cast<int>(rows_of_factor), static_cast<int>(rows_of_factor),
                             static_cast<int>(p), R.data());
  };
  each_part(problem, [&](const Problem& part, Eigen::Index) {
    const auto worker = [&] { return WhitenedRows(part, theta, free, scale, weighting.tau); };
    for (Eigen::Index first = 0; first < part.row_count(); first += group) {
      const Eigen::Index end = std::min(part.row_count(), first + group);
      const auto units = static_cast<std::size_t>((end - first + kUnitRows - 1) / kUnitRows);
      std::vector<Eigen::MatrixXd> factors(units);
      std::vector<Eigen::VectorXd> slopes(units);
      parallel_units(static_cast<Eigen::Index>(units), part.workers(), worker,
                     [&](WhitenedRows& whitened, Eigen::Index unit) {
                       const auto u = static_cast<std::size_t>(unit);
                       const Eigen::Index last = std::min(end, first + (unit + 1) * kUnitRows);
                       Eigen::VectorXd slope = Eigen::VectorXd::Zero(p);
                       factors[u] = Eigen::MatrixXd::Zero(p, p);
                       for (Eigen::Index begin = first + unit * kUnitRows; begin < last; begin += at_once)
                         add_rows(whitened, begin, std::min(last, begin + at_once), factors[u], slope);
                       slopes[u] = std::move(slope);
                     });
      for (std::size_t unit = 0; unit < units; ++unit) {
        if (g != nullptr) *g += slopes[unit];
        add(factors[unit]);
      }
    }
  });
  return R;
}

}  // namespace fastcal
