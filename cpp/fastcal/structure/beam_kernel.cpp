// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Assembly and solution of K u = f in four postures at once, compiled for the instruction sets chosen from at run time.
#include "fastcal/structure/beam_kernel.hpp"

#include "fastcal/kernels/instruction_sets.hpp"
#include "fastcal/structure/element_lanes.hpp"
#include "fastcal/structure/elimination_lanes.hpp"

namespace fastcal::beam {
namespace {

/// Where everything lies in the work array.
template <int D>
struct Work {
  static constexpr int B = ElementLanes<D>::B;
  Lane* blocks;   // (block_count, B, B)
  Lane* x;        // (free, B) right-hand side, then solution
  Lane* inverse;  // (free, B)
  Lane* y;        // (free, B) right-hand side of a derivative
  Lane* element;  // (elements, B * B + D) global S and lever, kept for the derivatives
  Lane* loose;  // (loose, 10) projector on the rotations that nothing holds (3 x 3), and a stiffness to hold them with

  FASTCAL_INLINE Work(const BeamPlan& plan, Lane* base) {
    blocks = base;
    x = blocks + plan.block_count * B * B;
    inverse = x + plan.free_count * B;
    y = inverse + plan.free_count * B;
    element = y + plan.free_count * B;
    loose = element + plan.element_count * (B * B + D);
  }
  static int size(const BeamPlan& plan) {
    return plan.block_count * B * B + 3 * plan.free_count * B + plan.element_count * (B * B + D) +
           10 * plan.loose_count;
  }
};

/// The postures of the four lanes; lanes beyond the batch repeat its last posture.
struct Postures {
  std::ptrdiff_t row[kLanes];

  FASTCAL_INLINE Postures(std::ptrdiff_t first, int count) {
    for (int i = 0; i < kLanes; ++i) row[i] = first + (i < count ? i : count - 1);
  }
  FASTCAL_INLINE void load(Lane& lane, const double* source, std::ptrdiff_t stride) const {
    double value[kLanes];
    for (int i = 0; i < kLanes; ++i) value[i] = source[row[i] * stride];
    __builtin_memcpy(&lane, value, sizeof(value));
  }
};

FASTCAL_INLINE void cross(const Lane* a, const Lane* b, Lane* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/// Local stiffness with its hinges, and the local change that the hinges make to the weight's forces.
template <int D>
FASTCAL_INLINE void make_element(const BeamPlan& plan, const BeamBatch& batch, const Postures& postures,
                                 const Lane* gravity, int index, ElementLanes<D>& e) {
  constexpr int B = ElementLanes<D>::B;
  const double* section = plan.section + index * kSectionNumbers;
  const std::ptrdiff_t start = plan.end_node[2 * index], end = plan.end_node[2 * index + 1];
  for (int i = 0; i < D; ++i) {
    Lane a, b;
    postures.load(a, batch.nodes + start * D + i, plan.node_count * D);
    postures.load(b, batch.nodes + end * D + i, plan.node_count * D);
    e.r[i] = b - a;
  }
  Lane up[3];
  if constexpr (D == 3) {
    for (int i = 0; i < 3; ++i) postures.load(up[i], batch.up.data + 3 * index + i, batch.up.stride);
  }
  find_axes(e, up, plan.round[index]);
  if (plan.sampled[index] < 0) {
    set_section(e, section);
  } else {
    const double* matrix = batch.stiffness.data + plan.sampled[index] * B * B;
    for (int i = 0; i < B * B; ++i) {
      postures.load(e.S[i / B][i % B], matrix + i, batch.stiffness.stride);
      e.S[i / B][i % B] *= section[7];
    }
  }
  for (Lane& entry : e.correction) entry = Lane{};
  const unsigned* released = plan.released + 2 * index;
  if ((released[0] | released[1]) == 0) return;
  Lane moment[3] = {};  // of the weight at the start, local: m/12 r x g, the opposite at the end
  const Lane lever = e.length * (section[6] / 12.0);
  for (int i = 1; i < D; ++i) {
    Lane along = e.axes[i][0] * gravity[0] + e.axes[i][1] * gravity[1];
    if constexpr (D == 3) along += e.axes[i][2] * gravity[2];
    moment[3 - i] = i == 1 ? lever * along : -lever * along;
  }
  for (int side = 0; side < 2; ++side) {
    for (int a = 0; a < 3; ++a) {
      if (released[side] >> a & 1u) release(e, side, a, side == 0 ? moment[a] : -moment[a]);
    }
  }
}

/// Takes the axes about which an element's end resists out of what is free to turn at its node.
FASTCAL_INLINE void keep_axes(const ElementLanes<3>& e, unsigned kept, const Lane& stiffness, Lane* loose) {
  loose[9] += stiffness;
  for (int a = 0; a < 3; ++a) {
    if (!(kept >> a & 1u)) continue;
    Lane v[3];
    for (int i = 0; i < 3; ++i) {
      v[i] = loose[3 * i] * e.axes[a][0] + loose[3 * i + 1] * e.axes[a][1] + loose[3 * i + 2] * e.axes[a][2];
    }
    const Lane square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    const Lane inverse = square > 1e-12 ? 1.0 / square : Lane{};
    for (int i = 0; i < 3; ++i) {
      const Lane scaled = v[i] * inverse;
      for (int j = 0; j < 3; ++j) loose[3 * i + j] -= scaled * v[j];
    }
  }
}

/// Adds an element to the blocks of its two ends and its weight to their loads.
template <int D>
FASTCAL_INLINE void add_element(const BeamPlan& plan, const Lane* gravity, int index, const ElementLanes<D>& e,
                                const Work<D>& work) {
  constexpr int B = ElementLanes<D>::B;
  const int start = plan.end_position[2 * index], end = plan.end_position[2 * index + 1];
  const double mass = plan.section[index * kSectionNumbers + 6];
  Lane weight[B], turning[B] = {};  // force and moment at the end; the moment at the start has the other sign
  for (int i = 0; i < D; ++i) weight[i] = gravity[i] * (0.5 * mass);
  if constexpr (D == 2) {
    turning[2] = (mass / 12.0) * (e.r[0] * gravity[1] - e.r[1] * gravity[0]);
  } else {
    cross(e.r, gravity, turning + 3);
    for (int i = 3; i < 6; ++i) turning[i] *= mass / 12.0;
  }
  for (int i = D; i < B; ++i) weight[i] = Lane{};
  if (end >= 0) {
    Lane* block = work.blocks + end * B * B;
    Lane* load = work.x + end * B;
    for (int i = 0; i < B; ++i) {
      load[i] += weight[i] - turning[i] + e.correction[i];
      for (int j = 0; j <= i; ++j) block[i * B + j] += e.S[i][j];
    }
  }
  if (start < 0) return;
  Lane carried[B];
  for (int i = 0; i < B; ++i) carried[i] = e.correction[i];
  carry<D>(e.r, carried, 1);
  Lane* load = work.x + start * B;
  for (int i = 0; i < B; ++i) load[i] += weight[i] + turning[i] - carried[i];
  Lane HS[B * B];
  for (int i = 0; i < B; ++i) {
    for (int j = 0; j < B; ++j) HS[i * B + j] = e.S[i][j];
  }
  for (int j = 0; j < B; ++j) carry<D>(e.r, HS + j, B);
  if (plan.coupling[index] >= 0) {
    Lane* block = work.blocks + plan.coupling[index] * B * B;
    if (start > end) {
      for (int i = 0; i < B * B; ++i) block[i] -= HS[i];
    } else {
      for (int i = 0; i < B; ++i) {
        for (int j = 0; j < B; ++j) block[j * B + i] -= HS[i * B + j];
      }
    }
  }
  for (int i = 0; i < B; ++i) carry<D>(e.r, HS + i * B, 1);
  Lane* block = work.blocks + start * B * B;
  for (int i = 0; i < B; ++i) {
    for (int j = 0; j <= i; ++j) block[i * B + j] += HS[i * B + j];
  }
}

/// Holds the rotations that nothing holds, so that they come out 0; a moment along one of them has no solution.
template <int D>
FASTCAL_INLINE void hold_loose(const BeamPlan& plan, const BeamBatch& batch, const Postures& postures,
                               const Work<D>& work, LaneMask& failed) {
  constexpr int B = ElementLanes<D>::B, R = ElementLanes<D>::R;
  for (int k = 0; k < plan.loose_count; ++k) {
    const int position = plan.loose_position[k];
    const Lane* loose = work.loose + 10 * k;
    if (batch.load.data != nullptr) {
      Lane moment[3] = {}, along = {}, size = {};
      for (int i = 0; i < R; ++i) {
        postures.load(moment[i], batch.load.data + plan.node[position] * B + D + i, batch.load.stride);
      }
      for (int i = 0; i < 3; ++i) {
        const Lane part = loose[3 * i] * moment[0] + loose[3 * i + 1] * moment[1] + loose[3 * i + 2] * moment[2];
        along += part * moment[i];
        size += moment[i] * moment[i];
      }
      failed |= along > 1e-16 * size;
    }
    if constexpr (D == 3) {
      Lane* block = work.blocks + position * B * B;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j <= i; ++j) block[(3 + i) * B + 3 + j] += loose[9] * loose[3 * i + j];
      }
    }
  }
}

template <int D>
FASTCAL_INLINE void assemble(const BeamPlan& plan, const BeamBatch& batch, const Postures& postures,
                             const Work<D>& work, LaneMask& failed) {
  constexpr int B = ElementLanes<D>::B;
  for (int i = 0; i < plan.block_count * B * B; ++i) work.blocks[i] = Lane{};
  for (int i = 0; i < plan.free_count * B; ++i) {
    work.x[i] = Lane{};
    if (batch.load.data != nullptr) {
      postures.load(work.x[i], batch.load.data + plan.node[i / B] * B + i % B, batch.load.stride);
    }
  }
  for (int k = 0; k < plan.loose_count; ++k) {
    const unsigned held = plan.held[plan.loose_position[k]] >> (D == 2 ? 5 : 3);
    for (int i = 0; i < 10; ++i) fill(work.loose[10 * k + i], i % 4 == 0 && i < 9 && !(held >> i / 4 & 1u) ? 1.0 : 0.0);
  }
  Lane gravity[D];
  for (int i = 0; i < D; ++i) postures.load(gravity[i], batch.gravity.data + i, batch.gravity.stride);
  for (int index = 0; index < plan.element_count; ++index) {
    ElementLanes<D> e;
    make_element<D>(plan, batch, postures, gravity, index, e);
    if constexpr (D == 3) {
      for (int side = 0; side < 2; ++side) {
        const int loose = plan.end_loose[2 * index + side];
        if (loose < 0) continue;
        // Any positive number of the right size will do, and a hinged element may have none of its own left.
        const Lane stiffness = e.length * e.length * (e.S[0][0] + e.S[1][1] + e.S[2][2]);
        keep_axes(e, plan.kept[2 * index + side], stiffness, work.loose + 10 * loose);
      }
    }
    turn_to_global(e, (plan.released[2 * index] | plan.released[2 * index + 1]) != 0);
    add_element<D>(plan, gravity, index, e, work);
    if (batch.group_count == 0) continue;
    Lane* kept = work.element + index * (B * B + D);
    for (int i = 0; i < B * B; ++i) kept[i] = e.S[i / B][i % B];
    for (int i = 0; i < D; ++i) kept[B * B + i] = e.r[i];
  }
  hold_loose<D>(plan, batch, postures, work, failed);
}

/// y = -dK/ds u = -(sum over the group of K_e) u, then K^-1 y is the derivative of u by the group's factor s at 1.
template <int D>
FASTCAL_INLINE void differentiate(const BeamPlan& plan, const BeamBatch& batch, int group, const Work<D>& work) {
  constexpr int B = ElementLanes<D>::B;
  for (int i = 0; i < plan.free_count * B; ++i) work.y[i] = Lane{};
  for (int index = 0; index < plan.element_count; ++index) {
    if (batch.group[index] != group) continue;
    const Lane* S = work.element + index * (B * B + D);
    const Lane(&r)[D] = *reinterpret_cast<const Lane(*)[D]>(S + B * B);
    const int start = plan.end_position[2 * index], end = plan.end_position[2 * index + 1];
    Lane v[B] = {}, force[B];
    if (end >= 0) {
      for (int i = 0; i < B; ++i) v[i] = work.x[end * B + i];
    }
    if (start >= 0) {
      const Lane* u = work.x + start * B;
      for (int i = 0; i < B; ++i) v[i] -= u[i];
      if constexpr (D == 2) {
        v[0] += r[1] * u[2];
        v[1] -= r[0] * u[2];
      } else {
        Lane moved[3];
        cross(u + 3, r, moved);
        for (int i = 0; i < 3; ++i) v[i] -= moved[i];
      }
    }
    for (int i = 0; i < B; ++i) {
      force[i] = Lane{};
      for (int j = 0; j < B; ++j) force[i] += S[i * B + j] * v[j];
    }
    for (int i = 0; i < B && end >= 0; ++i) work.y[end * B + i] -= force[i];
    if (start < 0) continue;
    carry<D>(r, force, 1);
    for (int i = 0; i < B; ++i) work.y[start * B + i] += force[i];
  }
  substitute<B>(plan, work.blocks, work.inverse, work.y);
}

/// Writes (free, B) lanes to rows (N, M, B) of numbers `step` apart.
template <int B>
FASTCAL_INLINE void scatter(const BeamPlan& plan, const Lane* x, std::ptrdiff_t first, int count, double* out,
                            std::ptrdiff_t step) {
  for (int lane = 0; lane < count; ++lane) {
    double* row = out + (first + lane) * plan.node_count * B * step;
    for (int i = 0; i < plan.free_count; ++i) {
      for (int c = 0; c < B; ++c) row[(plan.node[i] * B + c) * step] = x[i * B + c][lane];
    }
  }
}

template <int D>
FASTCAL_INLINE unsigned solve(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t first, int count,
                              Lane* base) {
  constexpr int B = ElementLanes<D>::B;
  const Work<D> work(plan, base);
  LaneMask failed = {};
  assemble<D>(plan, batch, Postures(first, count), work, failed);
  factorize<B>(plan, work.blocks, work.inverse, failed);
  substitute<B>(plan, work.blocks, work.inverse, work.x);
  scatter<B>(plan, work.x, first, count, batch.displacement, 1);
  for (int group = 0; group < batch.group_count; ++group) {
    differentiate<D>(plan, batch, group, work);
    scatter<B>(plan, work.y, first, count, batch.derivative + group, batch.group_count);
  }
  unsigned bits = 0;
  for (int lane = 0; lane < count; ++lane) bits |= failed[lane] != 0 ? 1u << lane : 0u;
  return bits;
}

template <int D>
AssembledLanes assemble_one(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t posture, Lane* base) {
  const Work<D> work(plan, base);
  LaneMask failed = {};
  assemble<D>(plan, batch, Postures(posture, 1), work, failed);
  return {work.blocks, work.loose};
}

using Solve = unsigned (*)(const BeamPlan&, const BeamBatch&, std::ptrdiff_t, int, Lane*);

template <int D>
unsigned solve_baseline(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t first, int count, Lane* work) {
  return solve<D>(plan, batch, first, count, work);
}

#if defined(__x86_64__)
template <int D>
FASTCAL_AVX2 unsigned solve_avx2(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t first, int count,
                                 Lane* work) {
  return solve<D>(plan, batch, first, count, work);
}
#endif

template <int D>
Solve choose() {
#if defined(__x86_64__)
  if (kernels::instruction_set() >= kernels::InstructionSet::kAvx2) return solve_avx2<D>;
#endif
  return solve_baseline<D>;
}

}  // namespace

std::size_t work_lanes(const BeamPlan& plan) {
  return static_cast<std::size_t>(plan.dimension == 2 ? Work<2>::size(plan) : Work<3>::size(plan));
}

unsigned solve_lanes(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t first, int count, Lane* work) {
  static const Solve plane = choose<2>(), space = choose<3>();
  return (plan.dimension == 2 ? plane : space)(plan, batch, first, count, work);
}

AssembledLanes assemble_lanes(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t posture, Lane* base) {
  return plan.dimension == 2 ? assemble_one<2>(plan, batch, posture, base)
                             : assemble_one<3>(plan, batch, posture, base);
}

}  // namespace fastcal::beam
