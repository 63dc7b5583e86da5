// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/measurement/measurements.hpp"

namespace fastcal {
namespace {

std::string role_name(FieldRole role) {
  return role == FieldRole::kMeasured ? "measured" : role == FieldRole::kSigma ? "sigma" : "label";
}

}  // namespace

void bind_measurement(py::module_& m) {
  py::class_<Field>(m, "Field", "One table of a data set and the columns of a file that it is read from.")
      .def_readonly("name", &Field::name)
      .def_property_readonly(
          "role", [](const Field& self) { return role_name(self.role); }, "measured, sigma or label")
      .def_readonly("columns", &Field::columns, "without their units")
      .def_readonly("quantity", &Field::quantity, "length, angle ...; empty: plain numbers or labels")
      .def_readonly("written_unit", &Field::written_unit)
      .def_readonly("each_link", &Field::each_link, "one table a link: NAME@linkN");

  py::class_<ObservationEntry>(m, "ObservationEntry", "What the registry knows of a kind of observation.")
      .def_readonly("plural", &ObservationEntry::plural)
      .def_readonly("fields", &ObservationEntry::fields)
      .def_readonly("note", &ObservationEntry::note, "for a reader of data that have it; may be empty");

  m.def("observation_names", &observation_names, "Names of all kinds of observation, sorted.");
  m.def("observation_entry", &observation_entry, py::arg("name"), py::return_value_policy::reference);

  py::class_<PlacedObservation>(m, "Observation", "One observation of some measurements.")
      .def_property_readonly("name", [](const PlacedObservation& self) { return self->name(); })
      .def_property_readonly("components", [](const PlacedObservation& self) { return self->components(); })
      .def_property_readonly(
          "unit", [](const PlacedObservation& self) { return self->unit(); }, "m or rad")
      .def_property_readonly(
          "field", [](const PlacedObservation& self) { return self->field(); }, "of a data set, or empty")
      .def_property_readonly(
          "parameters", [](const PlacedObservation& self) { return self->parameters(); }, "its unknowns")
      .def_property_readonly("claims_sigma", [](const PlacedObservation& self) { return self->claims_sigma(); })
      .def_property_readonly("is_pose", [](const PlacedObservation& self) { return self->is_pose(); })
      .def_readonly("first_number", &PlacedObservation::first_number, "of its numbers in a row of residuals")
      .def_readonly("first_unknown", &PlacedObservation::first_unknown, "of its unknowns among all");

  py::class_<Measurements>(m, "Measurements", "N rows of what was measured, SI; NaN: not in this row.")
      .def(py::init([](const RobotModel& robot, Eigen::Index rows, const std::map<std::string, RowMatrixXd>& numbers,
                       const std::map<std::string, std::pair<Eigen::VectorXi, std::vector<std::string>>>& labels) {
             Tables tables{rows, numbers, {}};
             for (const auto& [name, label] : labels) tables.labels[name] = {label.first, label.second};
             return Measurements(tables, robot);
           }),
           py::arg("robot"), py::arg("rows"), py::arg("numbers"),
           py::arg("labels") = std::map<std::string, std::pair<Eigen::VectorXi, std::vector<std::string>>>(),
           "From tables by the names of fields; labels are indices and their names.")
      .def("__len__", &Measurements::rows)
      .def_property_readonly("observations", &Measurements::observations, py::return_value_policy::copy)
      .def("sigma", &Measurements::sigma, py::arg("row"), py::arg("number"), "claimed standard deviation; 0: none")
      .def_property_readonly("number_count", &Measurements::number_count)
      .def_property_readonly("parameters", &Measurements::parameters, "unknowns of all observations")
      .def_property_readonly("shows_base", &Measurements::shows_base)
      .def_property_readonly("shows_tool_turn", &Measurements::shows_tool_turn);
}

}  // namespace fastcal
