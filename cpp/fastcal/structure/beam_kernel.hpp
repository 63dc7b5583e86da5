// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The plain arrays between BeamSolver and its kernel. A node has B displacements: 3 in a plane frame (D = 2), else 6.
#pragma once

#include <cstddef>

#include "fastcal/structure/lanes.hpp"

namespace fastcal::beam {

/// A row for every posture, or (stride 0) one row for all.
struct Rows {
  const double* data = nullptr;
  std::ptrdiff_t stride = 0;
};

constexpr int kSectionNumbers = 8;  ///< E A, E I_y, E I_z, G J, G A_y, G A_z (0: stiff in shear), mass, scale

/// What all postures share. "Position" is the place of a node in the order of elimination, -1 where it is held.
struct BeamPlan {
  int dimension, node_count, element_count, sampled_count, free_count, block_count, loose_count;
  const int* end_node;       ///< (elements, 2)
  const int* end_position;   ///< (elements, 2)
  const int* end_loose;      ///< (elements, 2) which loose node the end belongs to, or -1
  const int* coupling;       ///< (elements) block between the two ends, -1 where one is held
  const double* section;     ///< (elements, kSectionNumbers)
  const int* sampled;        ///< (elements) its place among the sampled stiffness matrices, or -1
  const unsigned* released;  ///< (elements, 2) axes, bits x y z
  const unsigned* kept;      ///< (elements, 2) axes about which the end resists a rotation of its node
  const bool* round;         ///< (elements) y and z are alike, so any pair of them will do
  const unsigned* held;      ///< (free) directions, bits
  const int* node;           ///< (free) the node at a position
  const int* slot_begin;     ///< elimination.hpp
  const int* slot_row;
  const int* update;
  const int* loose_position;  ///< (loose) nodes whose rotation perhaps nothing holds
};

/// The postures and their results, C order.
struct BeamBatch {
  const double* nodes = nullptr;   ///< (N, M, D) [m]
  Rows load;                       ///< (M, B) forces and moments on the nodes [N, N m]; data null: none
  Rows gravity;                    ///< (D) [m/s^2]
  Rows up;                         ///< (elements, 3) a direction in the local x-z plane, on the side of +z
  Rows stiffness;                  ///< (sampled, B, B) local force at the end by displacement there, start clamped
  double* displacement = nullptr;  ///< (N, M, B)
  const int* group = nullptr;      ///< (elements) column of the derivative, -1 none
  int group_count = 0;
  double* derivative = nullptr;  ///< (N, M, B, groups) by a factor on each group's stiffness, at 1
};

/// Lanes that a kernel needs to work in.
std::size_t work_lanes(const BeamPlan& plan);

/// Solves postures first .. first + count - 1 (at most kLanes). Bit i of the answer: posture first + i has no solution.
unsigned solve_lanes(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t first, int count, Lane* work);

struct AssembledLanes {
  const Lane* blocks;  ///< (block_count, B, B), lower triangle of K in elimination order
  const Lane* loose;   ///< (loose, 10) projector on the rotations of a node that nothing holds (3 x 3), and a stiffness
};

/// Assembles one posture into every lane of `work`, for the diagnosis of what could not be solved.
AssembledLanes assemble_lanes(const BeamPlan& plan, const BeamBatch& batch, std::ptrdiff_t posture, Lane* work);

}  // namespace fastcal::beam
