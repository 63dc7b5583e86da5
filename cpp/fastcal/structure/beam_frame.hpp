// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What a frame of beams is, apart from where its nodes are: nodes, elements, hinges and supports. SI throughout.
#pragma once

#include <string>
#include <vector>

namespace fastcal {

/// A straight prismatic beam between two nodes; its local x runs from start to end, y and z are its principal axes.
struct BeamElement {
  int start = 0;            ///< node
  int end = 0;              ///< node
  double young = 0;         ///< E [Pa]
  double area = 0;          ///< A [m^2]
  double inertia_z = 0;     ///< I_z [m^4]: bending in the local x-y plane, the only one of a plane frame
  double inertia_y = 0;     ///< I_y [m^4]: bending in the local x-z plane (space frames)
  double torsion = 0;       ///< J [m^4], torsion constant (space frames)
  double shear = 0;         ///< G [Pa]
  double shear_area_y = 0;  ///< effective area kappa A for forces along y [m^2]; 0: stiff in shear (Euler-Bernoulli)
  double shear_area_z = 0;  ///< the same along z
  double mass = 0;          ///< [kg], spread evenly
  bool sampled = false;     ///< its stiffness is given with each posture; the numbers above but the mass are not used
};

/// Rotations of node and element's end that go separate ways, about the element's local axes.
struct BeamHinge {
  int element = 0;
  int end = 0;        ///< 0: start, 1: end
  unsigned axes = 4;  ///< bits: 1 x, 2 y, 4 z; a plane frame has z alone
};

/// Directions in which a node is held: bit i is displacement i of (ux, uy, rz) or (ux, uy, uz, rx, ry, rz).
struct BeamSupport {
  int node = 0;
  unsigned directions = 0;
};

struct BeamFrame {
  int dimension = 2;  ///< 2: plane, 3 displacements a node; 3: space, 6 displacements a node
  int node_count = 0;
  std::vector<BeamElement> elements;
  std::vector<BeamHinge> hinges;
  std::vector<BeamSupport> supports;
  std::vector<std::string> node_names = {};  ///< for messages; empty: their numbers
  std::vector<std::string> element_names = {};

  std::string node_name(int node) const;
  std::string element_name(int element) const;
  int freedom_count() const { return dimension == 2 ? 3 : 6; }
  unsigned all_directions() const { return (1u << freedom_count()) - 1; }
};

/// Throws InvalidInput unless the frame is one: indices in range, positive sections, every node held by something.
void check(const BeamFrame& frame);

}  // namespace fastcal
