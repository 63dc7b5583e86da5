// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Inverse kinematics: a batch, and one pose at a time.
#include <benchmark/benchmark.h>

#include "fastcal/ik/pose_solver.hpp"
#include "fastcal/model/prediction.hpp"
#include "scene.hpp"

namespace fastcal::bench {
namespace {

constexpr Eigen::Index kTargets = 512;

/// Reachable targets and seeds nearby.
struct Targets {
  Scene s = scene(kTargets);
  RowMatrixXd T{kTargets, 16};
  IkOptions options;

  Targets() {
    predict(s.model, s.samples, s.model.start(), 1, T.data());
    test::Random random(2);
    s.samples.q = s.samples.q.table().unaryExpr([&](double q) { return q + random.uniform(-0.1, 0.1); });
    options.limits = RowMatrixXd(6, 2);
    options.limits.col(0).setConstant(-3.5);
    options.limits.col(1).setConstant(3.5);
    options.reach = 2;
  }
};

void batch(benchmark::State& state) {
  const Targets of;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        inverse_kinematics(of.s.model, of.s.model.start(), of.s.samples, of.T, of.options).q.data());
  state.SetItemsProcessed(state.iterations() * kTargets);
}
BENCHMARK(batch);

void one_at_a_time(benchmark::State& state) {
  const Targets of;
  PoseSolver solver(of.s.model, of.s.samples.slice(0, 1), of.options);
  SearchPoint found;
  Eigen::Index row = 0;
  for (auto _ : state) {
    if (solver.solve(of.T.row(row).data(), of.s.samples.q.row(row), found) != IkStatus::kReached)
      state.SkipWithError("a target was not reached");
    row = (row + 1) % kTargets;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(one_at_a_time);

void forward_one_at_a_time(benchmark::State& state) {
  const Targets of;
  PoseSolver solver(of.s.model, of.s.samples.slice(0, 1), of.options);
  Eigen::Index row = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solver.forward(of.s.samples.q.row(row)).p.data());
    row = (row + 1) % kTargets;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(forward_one_at_a_time);

}  // namespace
}  // namespace fastcal::bench
