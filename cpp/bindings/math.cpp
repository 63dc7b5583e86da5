// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/math/spread_points.hpp"

namespace fastcal {

void bind_math(py::module_& m) {
  m.def("rpy_to_rotation", &rpy_to_rotation, py::arg("rpy"),
        "Fixed-axis XYZ angles (3,) in rad to R = Rz(yaw) Ry(pitch) Rx(roll), (3, 3), as URDF.");
  m.def("rotation_to_rpy", &rotation_to_rpy, py::arg("R"),
        "Roll, pitch, yaw in rad of a rotation (3, 3); roll is 0 at pitch = +-90 degrees.");
  m.def("quaternion_to_rotation", &quaternion_to_rotation, py::arg("wxyz"),
        "Rotation (3, 3) of a quaternion w, x, y, z, brought to length 1.");
  m.def("exp_so3", &exp_so3, py::arg("w"), "Rotation (3, 3) of the rotation vector w (3,) in rad.");
  m.def(
      "rotation_about",
      [](const std::string& axis, double angle) {
        FASTCAL_CHECK(axis == "x" || axis == "y" || axis == "z") << "an axis is x, y or z, got '" << axis << "'";
        return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis[0] - 'x')).toRotationMatrix();
      },
      py::arg("axis"), py::arg("angle"), "Rotation (3, 3) by an angle in rad about the axis 'x', 'y' or 'z'.");
  m.def("log_so3", &log_so3, py::arg("R"), "Rotation vector (3,) in rad of a rotation (3, 3), of length 0 to pi.");
  m.def(
      "spread_points", &spread_points, py::arg("x"), py::arg("first"), py::arg("most"), py::arg("apart"),
      py::call_guard<py::gil_scoped_release>(),
      "Rows of x (N, d): `first` and then, each time, the one that is farthest from all chosen before; at most `most`, "
      "none nearer than `apart` to another.");
}

}  // namespace fastcal
