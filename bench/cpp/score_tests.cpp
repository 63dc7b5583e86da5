// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Score tests of blocks of columns, as a diagnosis makes them: 900 numbers, 30 fitted parameters, 60 blocks of four.
#include "fastcal/diagnosis/score_tests.hpp"

#include <benchmark/benchmark.h>

#include "support/random.hpp"

namespace fastcal::bench {
namespace {

void score_tests(benchmark::State& state) {
  test::Random random(3);
  const auto matrix = [&](Eigen::Index rows, Eigen::Index columns) -> Eigen::MatrixXd {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
  };
  const Eigen::MatrixXd A = matrix(900, 30), C = matrix(900, 240);
  const Eigen::VectorXd r = matrix(900, 1);
  const std::vector<int> sizes(60, 4);
  for (auto _ : state) benchmark::DoNotOptimize(ScoreTests(A, C, r, sizes).scores().statistic.data());
}
BENCHMARK(score_tests)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace fastcal::bench
