// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/structure/arm_structure.hpp"
#include "fastcal/structure/beam_solver.hpp"
#include "fastcal/structure/stiffness_table.hpp"

namespace py = pybind11;
using namespace py::literals;

namespace {

using Array = py::array_t<double, py::array::c_style>;
using fastcal::BeamSolver;
using fastcal::StiffnessTable;

/// An array of `row` numbers for all postures, or of `count` times as many, a row for each.
fastcal::beam::Rows rows_of(const std::optional<Array>& array, py::ssize_t row, py::ssize_t count, const char* name) {
  if (!array) return {};
  FASTCAL_CHECK(array->size() == row || array->size() == count * row)
      << name << " must hold " << row << " numbers, or " << row << " for each of " << count << " postures, got "
      << array->size();
  return {array->data(), array->size() == row ? 0 : row};
}

std::unique_ptr<BeamSolver> make_solver(int dimension, int node_count, const std::vector<std::pair<int, int>>& elements,
                                        const Array& sections, const std::vector<bool>& sampled,
                                        const std::vector<std::tuple<int, int, unsigned>>& hinges,
                                        const std::vector<std::pair<int, unsigned>>& supports) {
  fastcal::BeamFrame frame;
  frame.dimension = dimension;
  frame.node_count = node_count;
  FASTCAL_CHECK(sections.ndim() == 2 && sections.shape(1) == 9 &&
                sections.shape(0) == static_cast<py::ssize_t>(elements.size()) && sampled.size() == elements.size())
      << "sections must have shape (" << elements.size() << ", 9) and sampled as many rows";
  const auto table = sections.unchecked<2>();
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const auto number = [&](int column) { return table(static_cast<py::ssize_t>(i), column); };
    frame.elements.push_back({elements[i].first, elements[i].second, number(0), number(1), number(2), number(3),
                              number(4), number(5), number(6), number(7), number(8), sampled[i]});
  }
  for (const auto& [element, end, axes] : hinges) frame.hinges.push_back({element, end, axes});
  for (const auto& [node, directions] : supports) frame.supports.push_back({node, directions});
  return std::make_unique<BeamSolver>(std::move(frame));
}

struct Call {
  fastcal::BeamPostures postures;
  py::ssize_t size;
};

Call make_call(const BeamSolver& solver, const Array& nodes, const std::optional<Array>& load, const Array& gravity,
               const std::optional<Array>& up, const std::optional<Array>& stiffness) {
  const auto& frame = solver.frame();
  const py::ssize_t M = frame.node_count, D = frame.dimension, B = frame.freedom_count();
  const auto elements = static_cast<py::ssize_t>(frame.elements.size());
  FASTCAL_CHECK(nodes.ndim() == 3 && nodes.shape(1) == M && nodes.shape(2) == D)
      << "nodes must have shape (N, " << M << ", " << D << ")";
  Call call;
  const py::ssize_t count = nodes.shape(0);
  call.postures.count = count;
  call.postures.nodes = nodes.data();
  call.postures.load = rows_of(load, M * B, count, "load");
  call.postures.gravity = rows_of(gravity, D, count, "gravity");
  call.postures.up = rows_of(up, elements * 3, count, "up");
  call.postures.stiffness = rows_of(stiffness, solver.sampled_count() * B * B, count, "stiffness");
  call.size = count * M * B;
  return call;
}

double* output(Array& array, py::ssize_t size, const char* name) {
  FASTCAL_CHECK(array.size() == size) << name << " must hold " << size << " numbers, got " << array.size();
  return array.mutable_data();
}

void solve(const BeamSolver& solver, const Array& nodes, const std::optional<Array>& load, const Array& gravity,
           const std::optional<Array>& up, const std::optional<Array>& stiffness, const std::vector<double>& scale,
           int threads, Array displacement) {
  const Call call = make_call(solver, nodes, load, gravity, up, stiffness);
  double* out = output(displacement, call.size, "displacement");
  const py::gil_scoped_release release;
  solver.solve(call.postures, scale, threads, out);
}

void solve_with_derivative(const BeamSolver& solver, const Array& nodes, const std::optional<Array>& load,
                           const Array& gravity, const std::optional<Array>& up, const std::optional<Array>& stiffness,
                           const std::vector<double>& scale, const std::vector<int>& group, int group_count,
                           int threads, Array displacement, Array derivative) {
  const Call call = make_call(solver, nodes, load, gravity, up, stiffness);
  double* out = output(displacement, call.size, "displacement");
  double* derivative_out = output(derivative, call.size * group_count, "derivative");
  const py::gil_scoped_release release;
  solver.solve_with_derivative(call.postures, scale, group, group_count, threads, out, derivative_out);
}

fastcal::StructureNode make_node(const std::string& name, int origin, int frame, const Eigen::Vector3d& position,
                                 int moves, double mass, const std::vector<int>& links, bool carries_payload,
                                 unsigned held) {
  return {name, origin, frame, position, moves, mass, links, carries_payload, held};
}

fastcal::StructureElement make_element(const std::string& name, int start, int end,
                                       const std::optional<std::array<double, 8>>& section, double mass,
                                       const std::array<unsigned, 2>& hinges, int group, int up_frame,
                                       const Eigen::Vector3d& up, const std::optional<fastcal::Matrix6d>& stiffness,
                                       int table) {
  fastcal::StructureElement out;
  out.name = name;
  const std::array<double, 8> s = section.value_or(std::array<double, 8>{});
  out.beam = {start, end, s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], mass, !section.has_value()};
  out.start_hinge = hinges[0];
  out.end_hinge = hinges[1];
  out.group = group;
  out.up_frame = up_frame;
  out.up = up;
  if (stiffness) out.stiffness = *stiffness;
  out.table = table;
  return out;
}

/// The structure of a robot; tables are (table, angle joint, extension joint).
std::shared_ptr<fastcal::ArmStructure> make_structure(
    const std::vector<fastcal::StructureNode>& nodes, const std::vector<fastcal::StructureElement>& elements,
    const std::vector<std::tuple<const StiffnessTable*, int, int>>& tables, const std::vector<std::string>& groups) {
  fastcal::StructureDescription out{nodes, elements, {}, groups};
  for (const auto& [table, angle, extension] : tables) out.tables.push_back({*table, angle, extension});
  return std::make_shared<fastcal::ArmStructure>(std::move(out));
}

}  // namespace

namespace fastcal {

void bind_structure(py::module_& m) {
  py::class_<BeamSolver>(m, "BeamSolver", "Displacements of a frame of beams; fastcal.BeamFrame is its door.")
      .def(
          py::init(&make_solver), "dimension"_a, "node_count"_a, "elements"_a, "sections"_a.noconvert(), "sampled"_a,
          "hinges"_a, "supports"_a,
          "`sections` (elements, 9): E, A, I_z, I_y, J, G, shear area y and z, mass. `hinges` (element, end, axes) and "
          "`supports` (node, directions) hold bits.")
      .def("solve", &solve, "nodes"_a.noconvert(), "load"_a.noconvert(), "gravity"_a.noconvert(), "up"_a.noconvert(),
           "stiffness"_a.noconvert(), "scale"_a, "threads"_a, "displacement"_a.noconvert(),
           "Fills `displacement` (N, M, B) from `nodes` (N, M, D); the other arrays hold one row, or one a posture.")
      .def("solve_with_derivative", &solve_with_derivative, "nodes"_a.noconvert(), "load"_a.noconvert(),
           "gravity"_a.noconvert(), "up"_a.noconvert(), "stiffness"_a.noconvert(), "scale"_a, "group"_a,
           "group_count"_a, "threads"_a, "displacement"_a.noconvert(), "derivative"_a.noconvert(),
           "Fills `derivative` (N, M, B, groups) too: by a factor on the stiffness of each group of elements.");

  py::class_<StiffnessTable>(m, "StiffnessTable",
                             "Stiffness of an element's end, K_ij = f_ij(extension) g_ij(angle), from samples.")
      .def(py::init([](const Eigen::VectorXd& angle, const Eigen::VectorXd& extension,
                       const fastcal::RowMatrixXd& matrices, int angle_degree, int extension_degree) {
             return StiffnessTable({angle, extension, matrices}, angle_degree, extension_degree);
           }),
           "angle"_a, "extension"_a, "matrices"_a, "angle_degree"_a, "extension_degree"_a)
      .def_property_readonly("size", &StiffnessTable::size)
      .def_property_readonly("relative_error", &StiffnessTable::relative_error)
      .def("evaluate", &StiffnessTable::evaluate, "angle"_a, "extension"_a,
           "Matrices (N, size * size) at N pairs of angle [rad] and extension [m].");

  py::class_<StructureNode>(m, "StructureNode", "A node of an arm's beams, tied to frames of the chain.")
      .def(py::init(&make_node), py::kw_only(), "name"_a, "origin"_a, "frame"_a, "position"_a, "moves"_a, "mass"_a,
           "links"_a, "carries_payload"_a, "held"_a,
           "It stands at `position` (3,) [m] from the origin of frame `origin`, in the axes of `frame`, and moves the "
           "frame `moves` (-1: none); links count from 0; "
           "`held` holds bits of ux uy uz rx ry rz.");
  py::class_<StructureElement>(m, "StructureElement", "An element of an arm's beams.")
      .def(py::init(&make_element), py::kw_only(), "name"_a, "start"_a, "end"_a, "section"_a, "mass"_a, "hinges"_a,
           "group"_a, "up_frame"_a, "up"_a, "stiffness"_a, "table"_a,
           "`section` (8,): E, A, I_z, I_y, J, G, shear area y and z; None where `stiffness` (6, 6) or a table gives "
           "the stiffness. `hinges`: bits of x y z at start and end.");
  py::class_<ArmStructure, ArmBending, std::shared_ptr<ArmStructure>>(
      m, "ArmStructure", "The beams of an arm; fastcal.structure makes it from a robot file.")
      .def(py::init(&make_structure), "nodes"_a, "elements"_a, "tables"_a, "groups"_a,
           "`tables`: (StiffnessTable, joint that turns it, joint that extends it), joints from 0, -1: none.");
}

}  // namespace fastcal
