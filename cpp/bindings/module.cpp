// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <glog/logging.h>

#include <cstdlib>
#include <string>

#include "convert.hpp"
#include "fastcal/kernels/instruction_sets.hpp"

namespace fastcal {
void bind_math(py::module_& m);
void bind_robot(py::module_& m);
void bind_effects(py::module_& m);
void bind_measurement(py::module_& m);
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
  if (fastcal::kernels::instruction_set() == fastcal::kernels::InstructionSet::kUnavailable)
    throw pybind11::import_error(
        "FASTCAL_ISA must be baseline, avx2 or avx512, as far as the processor has them, got " +
        std::string(std::getenv("FASTCAL_ISA")));
  m.def(
      "instruction_set", [] { return std::string(fastcal::kernels::name_of(fastcal::kernels::instruction_set())); },
      "The instruction set that kernels run on: baseline, avx2, avx512 or neon; FASTCAL_ISA chooses it.");
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
  fastcal::bind_measurement(m);
  fastcal::bind_model(m);
  fastcal::bind_identification(m);
  fastcal::bind_ik(m);
  fastcal::bind_structure(m);
  fastcal::bind_subset_search(m);
  fastcal::bind_design(m);
  fastcal::bind_diagnosis(m);
}
