// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/effects/effect.hpp"
#include "fastcal/effects/owners.hpp"
#include "fastcal/effects/registry.hpp"
#include "fastcal/effects/tabulated_effect.hpp"

namespace fastcal {

void bind_effects(py::module_& m) {
  py::class_<Effect, std::shared_ptr<Effect>>(
      m, "Effect", "One physical cause of pose error, as small twists on frames of the chain.")
      .def_property_readonly("parameters", &Effect::parameters)
      .def_property_readonly("data_columns", &Effect::data_columns,
                             "Columns of the data that it cannot do without, beside q.")
      .def_property_readonly("penalty", &Effect::penalty,
                             "Weights of a quadratic penalty on the parameters, one each; empty: none.");
  m.def("effect_names", &effect_names, "Names of all registered effects, sorted.");
  m.def(
      "effect_owners",
      [](const std::string& name, const RobotModel& robot) { return effect_entry(name).owners(robot); },
      py::arg("name"), py::arg("robot"), "All owners that a robot has for an effect.");
  m.def(
      "make_effect",
      [](const std::string& name, const RobotModel& robot, const std::string& owner, const Options& options) {
        return std::const_pointer_cast<Effect>(make_effect(name, robot, owner, options));
      },
      py::arg("name"), py::arg("robot"), py::arg("owner"), py::arg("options") = Options(),
      "The effect of one owner; InvalidInput names what is wrong.");
  m.def(
      "tabulated_effect",
      [](const RobotModel& robot, const std::string& owner,
         const std::vector<std::tuple<std::string, std::string, double, std::string>>& parameters,
         const std::vector<std::string>& frames, int first) -> std::shared_ptr<Effect> {
        std::vector<Parameter> own;
        for (const auto& [name, unit, sigma, doc] : parameters) own.push_back({owner, name, unit, sigma, doc});
        std::vector<int> numbers;
        for (const std::string& frame : frames) numbers.push_back(frame_index("a registered effect", frame, robot));
        return std::make_shared<TabulatedEffect>(std::move(own), std::move(numbers), first);
      },
      py::arg("robot"), py::arg("owner"), py::arg("parameters"), py::arg("frames"), py::arg("first"),
      "An effect whose basis stands in Samples.table from column `first` on, (frame, parameter, 6); parameters: (name, "
      "unit, sigma, doc).");
}

}  // namespace fastcal
