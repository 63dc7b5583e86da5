// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <glog/logging.h>

#include "convert.hpp"

namespace fastcal {
void bind_math(py::module_& m);
void bind_robot(py::module_& m);
void bind_effects(py::module_& m);
void bind_model(py::module_& m);
void bind_identification(py::module_& m);
void bind_ik(py::module_& m);
void bind_structure(py::module_& m);
void bind_subset_search(py::module_& m);
void bind_design(py::module_& m);
void bind_diagnosis(py::module_& m);
}  // namespace fastcal

PYBIND11_MODULE(_core, m) {
  m.doc() = "fastcal's core: robots, effects, identification. Everything is SI; twists are [v; w].";
  m.attr("__version__") = FASTCAL_VERSION;
  FLAGS_minloglevel = 3;  // Ceres logs through glog, which writes to standard error although Ceres is told to be silent
  pybind11::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const fastcal::InvalidInput& error) {
      pybind11::set_error(pybind11::module_::import("fastcal.errors").attr("InvalidInput"), error.what());
    }
  });
  fastcal::bind_math(m);
  fastcal::bind_robot(m);
  fastcal::bind_effects(m);
  fastcal::bind_model(m);
  fastcal::bind_identification(m);
  fastcal::bind_ik(m);
  fastcal::bind_structure(m);
  fastcal::bind_subset_search(m);
  fastcal::bind_design(m);
  fastcal::bind_diagnosis(m);
}
