// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/chain_kernel.hpp"

#include "fastcal/ik/chain_lanes.hpp"
#include "fastcal/kernels/instruction_sets.hpp"

namespace fastcal::ik {
namespace {

constexpr double kProgress = 0.5;  // an attempt that does not bring the squared error down by this much
constexpr int kPatience = 3;       // in as many iterations is given up

/// What the lanes work on.
template <int W, int N>
struct Work {
  const ChainPlan& plan;
  const ChainBatch& batch;
  ChainLanes<W, N> lanes;
  int next = 0, active = 0;
  int item[W], attempt[W], iteration[W], evaluations[W], waited[W];
  double least[W], best[W];

  FASTCAL_INLINE Work(const ChainPlan& p, const ChainBatch& b) : plan(p), batch(b), lanes(p.joint_count) {
    for (int lane = 0; lane < W; ++lane) load(lane);
  }

  FASTCAL_INLINE void begin(int lane) {
    iteration[lane] = waited[lane] = 0;
    least[lane] = __builtin_inf();
  }

  /// The next target; lanes beyond the last repeat it, unheard.
  FASTCAL_INLINE void load(int lane) {
    const int from = next < batch.count ? next : batch.count - 1;
    item[lane] = next < batch.count ? next : -1;
    if (next < batch.count) {
      ++next;
      ++active;
    }
    for (int k = 0; k < kPoseNumbers; ++k) lanes.target[k][lane] = batch.target[from * kPoseNumbers + k];
    for (int i = 0; i < lanes.n; ++i) {
      const double q = batch.seed[from * lanes.n + i];
      lanes.q[i][lane] = q < plan.low[i] ? plan.low[i] : q > plan.high[i] ? plan.high[i] : q;
    }
    attempt[lane] = evaluations[lane] = 0;
    best[lane] = __builtin_inf();
    begin(lane);
  }

  /// Writes what a lane has met, if it is the best so far.
  FASTCAL_INLINE void keep(int lane, const typename ChainLanes<W, N>::Lane* q, double cost, bool reached) {
    const int i = item[lane];
    if (cost < best[lane] || reached) {
      best[lane] = cost;
      for (int k = 0; k < lanes.n; ++k) batch.q[i * lanes.n + k] = q[k][lane];
      batch.position_error[i] = std::sqrt(lanes.position_square[lane]);
      batch.rotation_error[i] = std::sqrt(lanes.rotation_square[lane]);
      batch.least_singular_value[i] = lanes.least_singular_value(lane);
    }
    batch.reached[i] = reached;
    batch.evaluations[i] = evaluations[lane];
  }

  /// Ends or goes on with one lane after a step; `q` is where the step began.
  FASTCAL_INLINE void proceed(int lane, const typename ChainLanes<W, N>::Lane* q) {
    const double cost = lanes.position_square[lane] + lanes.rotation_square[lane];
    const bool reached = lanes.position_square[lane] <= plan.tolerance_position * plan.tolerance_position &&
                         lanes.rotation_square[lane] <= plan.tolerance_rotation * plan.tolerance_rotation;
    ++evaluations[lane];
    ++iteration[lane];
    waited[lane] = cost < kProgress * least[lane] ? 0 : waited[lane] + 1;
    if (cost < least[lane]) least[lane] = cost;
    const bool stuck = iteration[lane] >= plan.iterations || waited[lane] > kPatience;
    if (!reached && !stuck) return;
    keep(lane, q, cost, reached);
    if (!reached && !(cost <= plan.close) && attempt[lane] < plan.restarts) {
      ++attempt[lane];
      for (int i = 0; i < lanes.n; ++i) {
        if (!plan.held[i]) lanes.q[i][lane] = restart(plan, batch.row[item[lane]], attempt[lane], i);
      }
      begin(lane);
    } else {
      --active;
      load(lane);
    }
  }

  FASTCAL_INLINE void run() {
    typename ChainLanes<W, N>::Lane q[ChainLanes<W, N>::kJoints];
    while (active > 0) {
      lanes.forward(plan);
      lanes.compare();
      for (int i = 0; i < lanes.n; ++i) q[i] = lanes.q[i];
      lanes.step(plan);
      for (int lane = 0; lane < W; ++lane) {
        if (item[lane] >= 0) proceed(lane, q);
      }
    }
  }
};

template <int W>
FASTCAL_INLINE void solve(const ChainPlan& plan, const ChainBatch& batch) {
  if (batch.count == 0) return;
  if (plan.joint_count == 6)
    Work<W, 6>(plan, batch).run();
  else if (plan.joint_count == 7)
    Work<W, 7>(plan, batch).run();
  else
    Work<W, 0>(plan, batch).run();
}

using Solve = void (*)(const ChainPlan&, const ChainBatch&);

void solve_baseline(const ChainPlan& plan, const ChainBatch& batch) { solve<4>(plan, batch); }

#if defined(__x86_64__)
FASTCAL_AVX2 void solve_avx2(const ChainPlan& plan, const ChainBatch& batch) { solve<4>(plan, batch); }
FASTCAL_AVX512 void solve_avx512(const ChainPlan& plan, const ChainBatch& batch) { solve<8>(plan, batch); }
#endif

Solve choose() {
#if defined(__x86_64__)
  if (kernels::instruction_set() == kernels::InstructionSet::kAvx512) return solve_avx512;
  if (kernels::instruction_set() == kernels::InstructionSet::kAvx2) return solve_avx2;
#endif
  return solve_baseline;
}

}  // namespace

void solve_chain(const ChainPlan& plan, const ChainBatch& batch) {
  static const Solve run = choose();
  run(plan, batch);
}

}  // namespace fastcal::ik
