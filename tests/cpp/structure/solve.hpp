// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Short forms of frames and loads for the tests.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fastcal/math/types.hpp"
#include "fastcal/structure/beam_solver.hpp"

namespace fastcal::test {

/// Steel-like numbers; tests that want others change them.
inline BeamElement beam(int start, int end) {
  BeamElement element;
  element.start = start;
  element.end = end;
  element.young = 2.1e11;
  element.shear = 8e10;
  element.area = 4e-3;
  element.inertia_z = 8e-6;
  element.inertia_y = 3e-6;
  element.torsion = 5e-6;
  element.mass = 30;
  return element;
}

inline BeamSupport fixed(int node, int dimension) { return {node, dimension == 2 ? 7u : 63u}; }

struct Loads {
  RowMatrixXd nodes;  ///< (M, B), empty: none
  Eigen::VectorXd gravity;
  RowMatrixXd up;  ///< (elements, 3), empty: global z
  RowMatrixXd stiffness;
};

/// Displacements (M, B) of one posture.
inline RowMatrixXd solve(const BeamFrame& frame, const RowMatrixXd& nodes, const Loads& loads,
                         const std::vector<double>& scale = {}) {
  const Eigen::VectorXd gravity = loads.gravity.size() > 0 ? loads.gravity : Eigen::VectorXd::Zero(frame.dimension);
  BeamPostures postures;
  postures.count = 1;
  postures.nodes = nodes.data();
  postures.gravity = {gravity.data(), 0};
  if (loads.nodes.size() > 0) postures.load = {loads.nodes.data(), 0};
  if (loads.up.size() > 0) postures.up = {loads.up.data(), 0};
  if (loads.stiffness.size() > 0) postures.stiffness = {loads.stiffness.data(), 0};
  RowMatrixXd displacement(frame.node_count, frame.freedom_count());
  BeamSolver(frame).solve(postures, scale, 1, displacement.data());
  return displacement;
}

}  // namespace fastcal::test
