// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Identification of 33 parameters (27 of geometry, base and tool, 6 reduction ratios) with rank, gauge and covariance,
// beside what an engineer would write with Ceres: the same parameters that fastcal frees, automatic and written-out
// derivatives, no covariance, no loss.
#include <benchmark/benchmark.h>

#include <cmath>

#include "elementary_motions.hpp"
#include "scene.hpp"

namespace fastcal::bench {
namespace {

/// RMS of the residuals, by the independent chain for the peers and as reported for fastcal.
double rms(const RowMatrixXd& residuals) {
  return std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.size()));
}

void fastcal_identifies(benchmark::State& state, LossKind loss) {
  const Scene s = scene(state.range(0), true);
  const Problem problem = s.problem();
  IdentifyOptions options;
  options.loss = loss;
  double left = 0;
  for (auto _ : state) left = rms(identify(problem, s.asked, Eigen::VectorXd(), options).residuals);
  state.counters["rms_um"] = 1e6 * left;
}

void ceres_solves(benchmark::State& state, Derivatives derivatives) {
  const Scene s = scene(state.range(0), true);
  const std::vector<int> free = identify(s.problem(), s.asked, Eigen::VectorXd(), {}).free;
  double left = 0;
  for (auto _ : state) left = solve_with_ceres(s.samples.q.table(), s.measured.position, free, derivatives);
  state.counters["rms_um"] = 1e6 * left;
}

void sizes(benchmark::internal::Benchmark* of) { of->Arg(50)->Arg(1000)->Arg(100'000)->Unit(benchmark::kMillisecond); }

BENCHMARK_CAPTURE(fastcal_identifies, no_loss, LossKind::kNone)->Apply(sizes);
BENCHMARK_CAPTURE(fastcal_identifies, tukey, LossKind::kTukey)->Apply(sizes);
BENCHMARK_CAPTURE(ceres_solves, automatic, Derivatives::kAutomatic)->Apply(sizes);
BENCHMARK_CAPTURE(ceres_solves, written_out, Derivatives::kWrittenOut)->Apply(sizes);

}  // namespace
}  // namespace fastcal::bench
