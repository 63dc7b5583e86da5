// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Passes over rows: predictions, Jacobians, normal sums, triangle, settled states, the best rigid fit.
#include <benchmark/benchmark.h>

#include "fastcal/effects/registry.hpp"
#include "fastcal/identification/alignment.hpp"
#include "fastcal/model/prediction.hpp"
#include "fastcal/model/settle.hpp"
#include "scene.hpp"

namespace fastcal::bench {
namespace {

constexpr Eigen::Index kRows = 4096;

void rows_per_second(benchmark::State& state) {
  state.counters["rows/s"] =
      benchmark::Counter(static_cast<double>(kRows), benchmark::Counter::kIsIterationInvariantRate);
}

void predict_poses(benchmark::State& state) {
  const Scene s = scene(kRows);
  std::vector<double> poses(16 * kRows);
  for (auto _ : state) predict(s.model, s.samples, s.model.start(), 1, poses.data());
  rows_per_second(state);
}
BENCHMARK(predict_poses);

void jacobian_of_parameters(benchmark::State& state) {
  const Scene s = scene(kRows);
  std::vector<double> J(static_cast<std::size_t>(3 * kRows * s.model.parameter_count()));
  for (auto _ : state) parameter_jacobian(s.model, s.samples, s.model.start(), 3, 1, J.data());
  rows_per_second(state);
}
BENCHMARK(jacobian_of_parameters);

void normal_sums(benchmark::State& state) {
  const Scene s = scene(kRows);
  const Problem problem = s.problem();
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(s.asked.size()), 1e-3);
  const Weighting weighting{{5e-5}, static_cast<LossKind>(state.range(0))};
  for (auto _ : state)
    benchmark::DoNotOptimize(normal_equations(problem, s.model.start(), s.asked, scale, weighting, true).cost);
  rows_per_second(state);
}
BENCHMARK(normal_sums)->Arg(static_cast<int>(LossKind::kNone))->Arg(static_cast<int>(LossKind::kTukey));

void triangle(benchmark::State& state) {
  const Scene s = scene(kRows);
  const Problem problem = s.problem();
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(s.asked.size()), 1e-3);
  for (auto _ : state)
    benchmark::DoNotOptimize(triangular_factor(problem, s.model.start(), s.asked, scale, {{5e-5}}).data());
  rows_per_second(state);
}
BENCHMARK(triangle);

void best_rigid_fit(benchmark::State& state) {
  const Scene s = scene(kRows);
  const Problem problem = s.problem();
  for (auto _ : state) benchmark::DoNotOptimize(align(problem).rms);
  rows_per_second(state);
}
BENCHMARK(best_rigid_fit);

void settled_compliances(benchmark::State& state) {
  Scene s = scene(kRows);
  RobotDescription description = s.model.robot().description();
  for (Body& body : description.bodies) body.mass = 20;
  const RobotModel heavy = build_dh(description, test::six_axes().rows);
  std::vector<std::shared_ptr<const Effect>> effects;
  for (int joint = 1; joint <= 6; ++joint)
    effects.push_back(make_effect("joint_compliance", heavy, "joint" + std::to_string(joint), {}));
  const ErrorModel model(heavy, effects, Eigen::VectorXd::Constant(6, 1e-6));
  for (auto _ : state) benchmark::DoNotOptimize(settle(model, model.start(), 1, s.samples));
  rows_per_second(state);
}
BENCHMARK(settled_compliances);

}  // namespace
}  // namespace fastcal::bench
