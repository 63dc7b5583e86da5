// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Beams for the arms of the tests.
#pragma once

#include <memory>

#include "fastcal/structure/arm_structure.hpp"

namespace fastcal::test {

/// A node at the origin of a frame, which it moves unless it is held.
inline StructureNode node_at(const std::string& name, int frame, bool held = false) {
  StructureNode node;
  node.name = name;
  node.origin = node.frame = frame;
  if (held) node.held = 63;
  if (!held) node.moves = frame;
  return node;
}

/// Round, E I = 1e5 N m^2 unless said.
inline StructureElement tube(const std::string& name, int start, int end, double mass, int group = 0, double EI = 1e5) {
  StructureElement element;
  element.name = name;
  element.beam.start = start;
  element.beam.end = end;
  element.beam.young = 2e11;
  element.beam.shear = 8e10;
  element.beam.area = 3e-3;
  element.beam.inertia_y = element.beam.inertia_z = EI / 2e11;
  element.beam.torsion = EI / 1e11;
  element.beam.mass = mass;
  element.group = group;
  return element;
}

/// Column, upper arm and forearm of a six-axis arm, the last up to the end of link 4; links 5 and 6 hang on it.
inline std::shared_ptr<const ArmBending> six_axis_beams() {
  StructureDescription out;
  out.nodes = {node_at("foot", kBaseFrame, true), node_at("shoulder", link_frame(0)), node_at("elbow", link_frame(1)),
               node_at("wrist", link_frame(3))};
  out.nodes[2].mass = 12;
  out.nodes[3].links = {4, 5};
  out.nodes[3].carries_payload = true;
  out.elements = {tube("column", 0, 1, 60), tube("upper arm", 1, 2, 40), tube("forearm", 2, 3, 25, 1, 4e4)};
  out.groups = {"lower", "upper"};
  return std::make_shared<ArmStructure>(out);
}

}  // namespace fastcal::test
