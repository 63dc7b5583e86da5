// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/linearization.hpp"

#include <algorithm>
#include <numeric>

#include "fastcal/identification/whitened_rows.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

/// Writes the numbers of rows begin ... end - 1 from place `at` on; returns how many there are.
Eigen::Index write(WhitenedRows& rows, Eigen::Index begin, Eigen::Index end, Eigen::Index at, Linearization& out) {
  const Eigen::Index first = at;
  rows.evaluate(begin, end);
  const double* J = rows.jacobian();
  const Eigen::Index p = out.J.cols();
  for (int i = 0; i < static_cast<int>(end - begin); ++i) {
    for (int n = 0; n < rows.number_count(); ++n) {
      if (!rows.is_measured(i, n)) continue;
      const Eigen::Map<const Eigen::RowVectorXd, 0, Eigen::InnerStride<>> numbers(J + rows.place(i, n), p + 1,
                                                                                  Eigen::InnerStride<>(rows.ld()));
      out.J.row(at) = numbers.head(p);
      out.r[at] = numbers[p];
      out.row[at] = static_cast<int>(begin) + i;
      out.number[at++] = n;
    }
  }
  return at - first;
}

/// Threads for so many columns: a few hundred rows of hundreds of columns are worth several.
int worker_count(const Problem& problem, Eigen::Index columns) {
  constexpr Eigen::Index kWorthAThread = 1 << 15;  // numbers of a component's Jacobian
  const Eigen::Index worth = problem.row_count() * columns / kWorthAThread;
  return std::clamp(static_cast<int>(worth), problem.workers(), std::max(problem.threads, problem.workers()));
}

}  // namespace

Linearization linearize(const Problem& problem, const Eigen::VectorXd& theta, const CommonNoise& tau, bool columns) {
  problem.check();
  FASTCAL_CHECK(theta.size() == problem.parameter_count())
      << "theta must hold " << problem.parameter_count() << " numbers, got " << theta.size();
  Samples samples = problem.samples;
  settle(problem.model, theta.head(problem.model.parameter_count()), problem.threads, samples);
  TwistMemory* memory = problem.model.needs() == kNothing ? problem.memory : nullptr;  // loads move with theta
  if (memory != nullptr) memory->prepare(problem.row_count());
  const Problem settled{problem.model, samples, problem.measured, problem.threads, nullptr, memory};
  const Eigen::Index rows = problem.row_count();
  const Eigen::Index numbers = problem.measured.number_count();
  std::vector<int> all(columns ? static_cast<std::size_t>(theta.size()) : 0);
  std::iota(all.begin(), all.end(), 0);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(all.size()));

  Linearization out{RowMatrixXd(rows * numbers, one.size()), Eigen::VectorXd(rows * numbers),
                    Eigen::VectorXi(rows * numbers), Eigen::VectorXi(rows * numbers)};
  std::vector<Eigen::Index> found(static_cast<std::size_t>(chunk_count(rows)));
  parallel_chunks(
      rows, worker_count(settled, one.size()), [&] { return WhitenedRows(settled, theta, all, one, tau); },
      [&](WhitenedRows& chunk, Eigen::Index index, Eigen::Index begin, Eigen::Index end) {
        // As if nothing were missing in the rows before.
        found[static_cast<std::size_t>(index)] = write(chunk, begin, end, begin * numbers, out);
      });

  Eigen::Index n = 0;
  for (std::size_t chunk = 0; chunk < found.size(); ++chunk) {
    Eigen::Index from = static_cast<Eigen::Index>(chunk) * kChunkRows * numbers;
    for (const Eigen::Index end = from + found[chunk]; from < end; ++from, ++n) {
      FASTCAL_CHECK(whitening_deviation(settled, tau, out.row[from], out.number[from]) > 0)
          << "row " << out.row[from] << " has a number without a standard deviation";
      if (n == from) continue;
      out.J.row(n) = out.J.row(from);
      out.r[n] = out.r[from];
      out.row[n] = out.row[from];
      out.number[n] = out.number[from];
    }
  }
  out.J.conservativeResize(n, Eigen::NoChange);
  out.r.conservativeResize(n);
  out.row.conservativeResize(n);
  out.number.conservativeResize(n);
  return out;
}

}  // namespace fastcal
