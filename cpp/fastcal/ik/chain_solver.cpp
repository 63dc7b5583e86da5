// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/chain_solver.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace fastcal {
namespace {

constexpr int kIterations = 40;

void write(const Pose& pose, double reach, double* out) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{out} = pose.R;
  Eigen::Map<Eigen::Vector3d>(out + 9) = pose.p / reach;
}

/// The root of x^(n + 1) = x + 1: powers of its inverse fill n dimensions evenly (M. Roberts, 2018).
double golden_ratio(int n) {
  double x = 2;
  for (int i = 0; i < 60; ++i) x = std::pow(1 + x, 1.0 / (n + 1));
  return x;
}

}  // namespace

ChainSolver::ChainSolver(const Chain& chain, const JointLimits& limits, const ChainSettings& settings)
    : limits_(limits), T_start_world_((chain.constants[0] * chain.constants[1]).inverse()), reach_(settings.reach) {
  const int n = chain.joint_count();
  plan_.joint_count = n;
  plan_.tolerance_position = settings.tolerance_position / reach_;
  plan_.tolerance_rotation = settings.tolerance_rotation;
  plan_.iterations = kIterations;
  plan_.random_seed = settings.random_seed;
  const double golden = golden_ratio(n);
  for (int i = 0; i < n; ++i) {
    const auto frame = static_cast<std::size_t>(link_frame(i));
    plan_.revolute[i] = chain.joint_types[static_cast<std::size_t>(i)] == JointType::kRevolute;
    plan_.held[i] = !settings.held.empty() && settings.held[static_cast<std::size_t>(i)];
    unit_.push_back(plan_.revolute[i] ? 1 : reach_);
    write(chain.constants[frame] * chain.constants[frame + 1], reach_, plan_.after[i]);
    plan_.low[i] = limits(i, 0) / unit_.back();
    plan_.high[i] = limits(i, 1) / unit_.back();
    const double far = plan_.revolute[i] ? M_PI : 1;
    plan_.from[i] = std::isfinite(plan_.low[i])    ? plan_.low[i]
                    : std::isfinite(plan_.high[i]) ? plan_.high[i] - 2 * far
                                                   : -far;
    plan_.span[i] = std::isfinite(plan_.high[i]) ? plan_.high[i] - plan_.from[i] : 2 * far;
    plan_.ratio[i] = std::pow(golden, -(i + 1));
  }
}

JointVector ChainSolver::restart(Eigen::Index row, int k) const {
  JointVector q(plan_.joint_count);
  for (int i = 0; i < plan_.joint_count; ++i) q[i] = unit_[static_cast<std::size_t>(i)] * ik::restart(plan_, row, k, i);
  return q;
}

std::vector<ChainSolution> ChainSolver::solve(std::span<const Eigen::Index> rows, std::span<const Pose> targets,
                                              std::span<const JointVector> seeds, int restarts, double close) const {
  const std::size_t count = rows.size();
  const int n = plan_.joint_count;
  const auto width = static_cast<std::size_t>(n);
  std::vector<double> numbers(count * (ik::kPoseNumbers + 2 * width + 3));
  double* target = numbers.data();
  double* seed = target + count * ik::kPoseNumbers;
  double* q = seed + count * width;
  double* found = q + count * width;
  const std::unique_ptr<bool[]> reached(new bool[count]);
  std::vector<int> evaluations(count);
  for (std::size_t i = 0; i < count; ++i) {
    write(T_start_world_ * targets[i], reach_, target + i * ik::kPoseNumbers);
    for (std::size_t k = 0; k < width; ++k) seed[i * width + k] = seeds[i][static_cast<Eigen::Index>(k)] / unit_[k];
  }
  ik::ChainPlan plan = plan_;
  plan.restarts = restarts;
  plan.close = close * close;
  ik::solve_chain(plan, {static_cast<int>(count), rows.data(), target, seed, q, found, found + count, found + 2 * count,
                         reached.get(), evaluations.data()});
  std::vector<ChainSolution> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    ChainSolution& solution = out[i];
    solution.q.resize(n);
    for (std::size_t k = 0; k < width; ++k) {
      const auto j = static_cast<Eigen::Index>(k);
      solution.q[j] = plan_.held[k] ? seeds[i][j] : q[i * width + k] * unit_[k];
    }
    solution.q = solution.q.cwiseMax(limits_.col(0)).cwiseMin(limits_.col(1));
    solution.reached = reached[i];
    solution.position_error = found[i] * reach_;
    solution.rotation_error = found[count + i];
    solution.least_singular_value = found[2 * count + i];
    solution.evaluations = evaluations[i];
  }
  return out;
}

}  // namespace fastcal
