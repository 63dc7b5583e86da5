// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Arrays across the border: Python hands over C-order float64, checked here for shape; poses are (4, 4).
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "fastcal/math/check.hpp"
#include "fastcal/math/types.hpp"

namespace fastcal {

namespace py = pybind11;

inline Pose to_pose(const Eigen::Ref<const Eigen::Matrix4d>& T) {
  FASTCAL_CHECK(T.row(3) == Eigen::RowVector4d(0, 0, 0, 1)) << "the last row of a pose must be 0 0 0 1";
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  FASTCAL_CHECK((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 && R.determinant() > 0)
      << "a pose must hold a rotation matrix, got one that is not orthonormal";
  return {R, T.topRightCorner<3, 1>()};
}

inline Eigen::Matrix4d from_pose(const Pose& T) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  out.topLeftCorner<3, 3>() = T.R;
  out.topRightCorner<3, 1>() = T.p;
  return out;
}

/// A caller's array to write into: float64, C order, of exactly this shape; nothing is copied.
inline double* output(py::array& out, const std::vector<py::ssize_t>& shape, const char* name) {
  const auto text = [](const std::vector<py::ssize_t>& sizes) {
    std::string s = "(";
    for (const py::ssize_t size : sizes) s += std::to_string(size) + ", ";
    return s + ")";
  };
  const std::vector<py::ssize_t> got(out.shape(), out.shape() + out.ndim());
  FASTCAL_CHECK(got == shape) << name << " must have shape " << text(shape) << ", got " << text(got);
  FASTCAL_CHECK(py::isinstance<py::array_t<double>>(out) && (out.flags() & py::array::c_style) && out.writeable())
      << name << " must be a writeable, C-order float64 array";
  return static_cast<double*>(out.mutable_data());
}

/// `out` if given (checked), else a new array.
inline py::array output_or_new(const py::object& out, const std::vector<py::ssize_t>& shape, double*& data) {
  py::array array =
      out.is_none() ? py::array(py::array_t<double>(shape)) : py::array(py::reinterpret_borrow<py::array>(out));
  data = output(array, shape, "out");
  return array;
}

}  // namespace fastcal
