// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <optional>

#include "convert.hpp"
#include "fastcal/measurement/measurements.hpp"

namespace fastcal {
namespace {

Camera& camera_of(Rig& rig, const std::string& name) {
  for (Camera& camera : rig.cameras) {
    if (camera.name == name) return camera;
  }
  throw InvalidInput("there is no camera '" + name + "'");
}

Standing& standing(Rig& rig, const std::string& name) {
  for (Board& board : rig.boards) {
    if (board.name == name) return board;
  }
  return camera_of(rig, name);
}

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
      .def_readonly("note", &ObservationEntry::note, "for a reader of data that have it; may be empty")
      .def_readonly("labelled", &ObservationEntry::labelled, "numbers of a row that a label alone marks");

  m.def("observation_names", &observation_names, "Names of all kinds of observation, sorted.");
  m.def("observation_entry", &observation_entry, py::arg("name"), py::return_value_policy::reference);

  py::class_<Rig>(m, "Rig", "Cameras and boards of a cell.")
      .def(py::init<>())
      .def(
          "add_camera",
          [](Rig& self, const std::string& name, int frame, const Eigen::Matrix4d& T_frame_camera, bool fixed,
             const std::string& lens, const std::vector<double>& intrinsics, bool identified) {
            FASTCAL_CHECK(intrinsics.size() >= 4 && intrinsics.size() <= intrinsic_names(lens_model(lens)).size())
                << "camera " << name << ": a lens has fx, fy, cx, cy and at most "
                << intrinsic_names(lens_model(lens)).size() - 4 << " coefficients, got " << intrinsics.size()
                << " numbers";
            Camera camera{{name, frame, to_pose(T_frame_camera), fixed}, lens_model(lens), Intrinsics::Zero(), 0};
            for (std::size_t k = 0; k < intrinsics.size(); ++k) camera.intrinsics[static_cast<int>(k)] = intrinsics[k];
            if (identified) camera.identified_intrinsics = static_cast<int>(intrinsics.size());
            self.cameras.push_back(std::move(camera));
          },
          py::arg("name"), py::arg("frame"), py::arg("T_frame_camera"), py::arg("fixed"), py::arg("lens"),
          py::arg("intrinsics"), py::arg("identified"), "`frame` of the chain, -1: the measuring frame.")
      .def(
          "add_board",
          [](Rig& self, const std::string& name, int frame, const Eigen::Matrix4d& T_frame_board, bool fixed,
             const RowMatrixXd& corners) {
            FASTCAL_CHECK(corners.cols() == 3)
                << "corners of a board must have shape (K, 3), got " << corners.cols() << " columns";
            self.boards.push_back({{name, frame, to_pose(T_frame_board), fixed}, corners.transpose()});
          },
          py::arg("name"), py::arg("frame"), py::arg("T_frame_board"), py::arg("fixed"), py::arg("corners"),
          "corners: (K, 3) [m] in the board's frame.")
      .def(
          "set_timing",
          [](Rig& self, const std::string& camera, double delay, double line_time, double middle_line) {
            Camera& own = camera_of(self, camera);
            own.delay = delay;
            own.line_time = line_time;
            own.middle_line = middle_line;
          },
          py::arg("camera"), py::arg("delay"), py::arg("line_time"), py::arg("middle_line"),
          "delay [s] of its pictures behind the joints at v = middle_line [px], and line_time [s] from line to line.")
      .def(
          "set_motion",
          [](Rig& self, const std::string& name, const RowMatrixXd& xi) { standing(self, name).motion = xi; },
          py::arg("name"), py::arg("xi"), "(N, 6) twist [m/s, rad/s] of the frame of a camera or board in each row.")
      .def(
          "set_shift",
          [](Rig& self, const std::string& name, const RowMatrixXd& xi) { standing(self, name).shift = xi; },
          py::arg("name"), py::arg("xi"),
          "(N, 6) twist [m, rad] by which a camera or board is out of place in each row, in the axes of its frame.");

  m.def(
      "draw",
      [](const std::string& lens, const std::vector<double>& intrinsics, const RowMatrixXd& points) {
        FASTCAL_CHECK(intrinsics.size() <= kMostIntrinsics && points.cols() == 3) << "draw takes (K, 3) points";
        Intrinsics own = Intrinsics::Zero();
        for (std::size_t k = 0; k < intrinsics.size(); ++k) own[static_cast<int>(k)] = intrinsics[k];
        RowMatrixXd out(points.rows(), 2);
        for (Eigen::Index i = 0; i < points.rows(); ++i)
          out.row(i) = draw(lens_model(lens), own, points.row(i).transpose()).uv.transpose();
        return out;
      },
      py::arg("lens"), py::arg("intrinsics"), py::arg("points"),
      "(K, 2) [px] of points (K, 3) [m] in a camera's frame; intrinsics fx fy cx cy and the lens' coefficients.");

  py::class_<PlacedObservation>(m, "Observation", "One observation of some measurements.")
      .def_property_readonly("name", [](const PlacedObservation& self) { return self->name(); })
      .def_property_readonly(
          "components",
          [](const PlacedObservation& self) {
            std::vector<std::string> names;
            for (int reading = 0; reading < self->reading_count(); ++reading)
              names.insert(names.end(), self->components().begin(), self->components().end());
            return names;
          },
          "of its numbers in a row, reading by reading")
      .def_property_readonly(
          "reading_count", [](const PlacedObservation& self) { return self->reading_count(); }, "of a row")
      .def_property_readonly(
          "unit", [](const PlacedObservation& self) { return self->unit(); }, "m, rad or px")
      .def_property_readonly(
          "field", [](const PlacedObservation& self) { return self->field(); }, "of a data set, or empty")
      .def_property_readonly(
          "parameters", [](const PlacedObservation& self) { return self->parameters(); }, "its unknowns")
      .def_property_readonly("claims_sigma", [](const PlacedObservation& self) { return self->claims_sigma(); })
      .def_property_readonly(
          "is_known", [](const PlacedObservation& self) { return self->is_known(); }, "beforehand, and not read")
      .def_property_readonly("is_pose", [](const PlacedObservation& self) { return self->is_pose(); })
      .def_readonly("first_number", &PlacedObservation::first_number, "of its numbers in a row of residuals");

  py::class_<Measurements>(m, "Measurements", "N rows of what was measured, SI; NaN: not in this row.")
      .def(py::init([](const RobotModel& robot, Eigen::Index rows, const std::map<std::string, RowMatrixXd>& numbers,
                       const std::map<std::string, std::pair<Eigen::VectorXi, std::vector<std::string>>>& labels,
                       const std::optional<Rig>& rig) {
             Tables tables{rows, numbers, {}, rig.value_or(Rig())};
             for (const auto& [name, label] : labels) tables.labels[name] = {label.first, label.second};
             return Measurements(tables, robot);
           }),
           py::arg("robot"), py::arg("rows"), py::arg("numbers"),
           py::arg("labels") = std::map<std::string, std::pair<Eigen::VectorXi, std::vector<std::string>>>(),
           py::arg("rig") = py::none(), "From tables by the names of fields; labels are indices and their names.")
      .def("__len__", &Measurements::rows)
      .def_property_readonly("observations", &Measurements::observations, py::return_value_policy::copy)
      .def("sigma", &Measurements::sigma, py::arg("row"), py::arg("number"), "claimed standard deviation; 0: none")
      .def_property_readonly("number_count", &Measurements::number_count)
      .def_property_readonly("parameters", &Measurements::parameters, "unknowns of all observations")
      .def_property_readonly("shows_base", &Measurements::shows_base)
      .def_property_readonly("shows_tool", &Measurements::shows_tool)
      .def_property_readonly("shows_tool_turn", &Measurements::shows_tool_turn)
      .def_property_readonly("shows_scale", &Measurements::shows_scale);
}

}  // namespace fastcal
