// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/effect.hpp"

#include "convert.hpp"
#include "fastcal/effects/registry.hpp"

namespace fastcal {

void bind_effects(py::module_& m) {
  py::class_<Effect, std::shared_ptr<Effect>>(m, "Effect", "One physical cause of pose error, as small twists on frames of the chain.")
      .def_property_readonly("parameters", &Effect::parameters);
  m.def("effect_names", &effect_names, "Names of all registered effects, sorted.");
  m.def(
      "effect_owners", [](const std::string& name, const RobotModel& robot) { return effect_entry(name).owners(robot); }, py::arg("name"), py::arg("robot"),
      "All owners that a robot has for an effect.");
  m.def(
      "make_effect",
      [](const std::string& name, const RobotModel& robot, const std::string& owner, const Options& options) {
        return std::const_pointer_cast<Effect>(make_effect(name, robot, owner, options));
      },
      py::arg("name"), py::arg("robot"), py::arg("owner"), py::arg("options") = Options(), "The effect of one owner; InvalidInput names what is wrong.");
}

}  // namespace fastcal
