// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/beam_frame.hpp"

#include <cmath>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

void check_positive(double value, const char* name, const std::string& element) {
  FASTCAL_CHECK(std::isfinite(value) && value > 0)
      << name << " of element " << element << " must be a positive number, got " << value;
}

void check_not_negative(double value, const char* name, const std::string& element) {
  FASTCAL_CHECK(std::isfinite(value) && value >= 0)
      << name << " of element " << element << " must be a number that is not negative, got " << value;
}

void check_element(const BeamFrame& frame, std::size_t index) {
  const BeamElement& element = frame.elements[index];
  const std::string name = frame.element_name(static_cast<int>(index));
  for (const int node : {element.start, element.end}) {
    FASTCAL_CHECK(node >= 0 && node < frame.node_count)
        << "element " << name << " names node " << node << ", but the nodes are 0 to " << frame.node_count - 1;
  }
  FASTCAL_CHECK(element.start != element.end)
      << "element " << name << " begins and ends at node " << frame.node_name(element.start);
  check_not_negative(element.mass, "mass", name);
  if (element.sampled) return;
  check_positive(element.young, "Young's modulus", name);
  check_positive(element.area, "area", name);
  check_positive(element.inertia_z, frame.dimension == 2 ? "second moment of area" : "second moment of area I_z", name);
  check_not_negative(element.shear_area_y, "shear area", name);
  if (frame.dimension == 3) {
    check_positive(element.inertia_y, "second moment of area I_y", name);
    check_positive(element.torsion, "torsion constant", name);
    check_positive(element.shear, "shear modulus", name);
    check_not_negative(element.shear_area_z, "shear area", name);
  } else if (element.shear_area_y > 0) {
    check_positive(element.shear, "shear modulus", name);
  }
}

void check_hinges(const BeamFrame& frame) {
  std::vector<unsigned> released(2 * frame.elements.size(), 0);
  const unsigned known = frame.dimension == 2 ? 4 : 7;
  for (const BeamHinge& hinge : frame.hinges) {
    FASTCAL_CHECK(hinge.element >= 0 && static_cast<std::size_t>(hinge.element) < frame.elements.size())
        << "a hinge names element " << hinge.element << ", but there are " << frame.elements.size() << " elements";
    FASTCAL_CHECK(hinge.end == 0 || hinge.end == 1)
        << "a hinge of element " << hinge.element << " must be at end 0 or 1, got " << hinge.end;
    FASTCAL_CHECK(hinge.axes != 0 && (hinge.axes & ~known) == 0)
        << "a hinge of element " << hinge.element
        << (frame.dimension == 2 ? " of a plane frame turns about z" : " turns about some of its axes x, y, z");
    released[2 * static_cast<std::size_t>(hinge.element) + static_cast<std::size_t>(hinge.end)] |= hinge.axes;
  }
  for (std::size_t i = 0; i < frame.elements.size(); ++i) {
    FASTCAL_CHECK((released[2 * i] & released[2 * i + 1] & 1u) == 0)
        << "element " << frame.element_name(static_cast<int>(i))
        << " is free to spin about its own axis: both of its ends are released about x";
  }
}

}  // namespace

std::string BeamFrame::node_name(int node) const {
  return node_names.empty() ? std::to_string(node) : node_names[static_cast<std::size_t>(node)];
}

std::string BeamFrame::element_name(int element) const {
  return element_names.empty() ? std::to_string(element) : element_names[static_cast<std::size_t>(element)];
}

void check(const BeamFrame& frame) {
  FASTCAL_CHECK(frame.dimension == 2 || frame.dimension == 3)
      << "a frame has 2 or 3 dimensions, got " << frame.dimension;
  FASTCAL_CHECK(!frame.elements.empty()) << "a frame needs at least one element";
  std::vector<bool> touched(static_cast<std::size_t>(frame.node_count), false);
  for (std::size_t i = 0; i < frame.elements.size(); ++i) {
    check_element(frame, i);
    touched[static_cast<std::size_t>(frame.elements[i].start)] = true;
    touched[static_cast<std::size_t>(frame.elements[i].end)] = true;
  }
  check_hinges(frame);
  FASTCAL_CHECK(!frame.supports.empty()) << "a frame needs at least one support";
  for (const BeamSupport& support : frame.supports) {
    FASTCAL_CHECK(support.node >= 0 && support.node < frame.node_count)
        << "a support names node " << support.node << ", but the nodes are 0 to " << frame.node_count - 1;
    FASTCAL_CHECK(support.directions != 0 && (support.directions & ~frame.all_directions()) == 0)
        << "the support at node " << support.node << " names directions that a node does not have";
    if (support.directions == frame.all_directions()) touched[static_cast<std::size_t>(support.node)] = true;
  }
  for (std::size_t node = 0; node < touched.size(); ++node) {
    FASTCAL_CHECK(touched[node]) << "node " << frame.node_name(static_cast<int>(node))
                                 << " is free: no element ends there";
  }
}

}  // namespace fastcal
