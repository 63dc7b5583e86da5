// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "convert.hpp"
#include "fastcal/effects/branch_effect.hpp"
#include "fastcal/effects/effect.hpp"
#include "fastcal/effects/owners.hpp"
#include "fastcal/effects/registry.hpp"
#include "fastcal/effects/tabulated_effect.hpp"

namespace fastcal {
namespace {

std::string text(Role role) {
  switch (role) {
    case Role::kCause:
      return "cause";
    case Role::kNuisance:
      return "nuisance";
    case Role::kLoadModifier:
      return "load modifier";
    case Role::kCurve:
      return "curve";
    case Role::kScanned:
      return "scanned";
    case Role::kOnRequest:
      break;
  }
  return "on request";
}

std::string text(Place place) {
  switch (place) {
    case Place::kJoint:
      return "joint";
    case Place::kLink:
      return "link";
    case Place::kBase:
      return "base";
    case Place::kTool:
      return "tool";
    case Place::kPayload:
      return "payload";
    case Place::kInstrument:
      return "instrument";
    case Place::kStructure:
      return "structure";
    case Place::kLoop:
      return "loop";
    case Place::kFrame:
      return "frame";
    case Place::kAnywhere:
      break;
  }
  return "anywhere";
}

std::string text(Reference reference) {
  switch (reference) {
    case Reference::kAxes:
      return "axes";
    case Reference::kBase:
      return "base";
    case Reference::kFlange:
      return "flange";
    case Reference::kRows:
      break;
  }
  return "rows";
}

py::dict traits_dict(const Traits& traits) {
  py::dict out;
  out["phrase"] = traits.phrase;
  out["role"] = text(traits.role);
  out["place"] = text(traits.place);
  out["depends_on"] = py::tuple(py::cast(traits.depends_on));
  out["needs_data"] = traits.needs_data;
  out["shown_by"] = traits.shown_by;
  out["generalizes"] = py::tuple(py::cast(traits.generalizes));
  out["contrast"] = py::tuple(py::cast(traits.contrast));
  out["refers_to"] = text(traits.refers_to);
  out["of_the_measurement"] = traits.of_the_measurement;
  out["plotted_over"] = traits.plotted_over;
  out["options_from_data"] = py::tuple(py::cast(traits.options_from_data));
  out["labels"] = traits.labels;
  out["among_parameters"] = py::tuple(py::cast(traits.among_parameters));
  out["searched"] = traits.searched;
  out["diagnosed_with"] = traits.diagnosed_with;
  out["forms"] = py::tuple(py::cast(traits.forms));
  out["without_masses"] = traits.without_masses;
  out["is_wave"] = traits.is_wave;
  out["number"] = traits.number;
  return out;
}

}  // namespace

void bind_effects(py::module_& m) {
  py::class_<Effect, std::shared_ptr<Effect>>(
      m, "Effect", "One physical cause of pose error, as small twists on frames of the chain.")
      .def_property_readonly("parameters", &Effect::parameters)
      .def_property_readonly("follows_loads", &Effect::follows_loads, "Does it yield to loads?")
      .def_property_readonly("data_columns", &Effect::data_columns,
                             "Columns of the data that it cannot do without, beside q.")
      .def_property_readonly("penalty", &Effect::penalty,
                             "Weights of a quadratic penalty on the parameters, one each; empty: none.")
      .def_property_readonly(
          "reference",
          [](const Effect& effect) {
            std::map<std::string, std::pair<std::string, std::vector<double>>> out;
            for (const auto& [name, option] : effect.reference()) out[name] = {option.unit, option.values};
            return out;
          },
          "Options by which the numbers keep their meaning on a robot whose geometry has moved: unit and SI values.");
  m.attr("SHOWN_BY_LOADS") = kShownByLoads;
  m.attr("SHOWN_BY_MOTION") = kShownByMotion;
  m.def("effect_names", &effect_names, "Names of all registered effects, sorted.");
  m.def(
      "effect_traits", [](const std::string& name) { return traits_dict(effect_entry(name).traits); }, py::arg("name"),
      "What an effect states about itself, by the names of fastcal.effects.traits.Traits.");
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
      "on_branch",
      [](const std::shared_ptr<Effect>& effect, const RobotModel& tree, const std::string& name, const RobotModel& arm,
         int extra, int table) {
        return std::const_pointer_cast<Effect>(on_branch(effect, tree, name, arm, {.extra = extra, .table = table}));
      },
      py::arg("effect"), py::arg("tree"), py::arg("name"), py::arg("arm"), py::arg("extra") = 0, py::arg("table") = 0,
      "An effect made for an arm alone, on the arm of this name in a cell; InvalidInput where it cannot be. `extra`, "
      "`table`: columns of these samples that are of the arms before it.");
  m.def(
      "tabulated_effect",
      [](const RobotModel& robot, const std::string& owner,
         const std::vector<std::tuple<std::string, std::string, double, std::string>>& parameters,
         const std::vector<std::string>& frames, int first, bool follows_loads) -> std::shared_ptr<Effect> {
        std::vector<Parameter> own;
        for (const auto& [name, unit, sigma, doc] : parameters) own.push_back({owner, name, unit, sigma, doc});
        std::vector<int> numbers;
        for (const std::string& frame : frames) numbers.push_back(frame_index("a registered effect", frame, robot));
        return std::make_shared<TabulatedEffect>(std::move(own), std::move(numbers), first, follows_loads);
      },
      py::arg("robot"), py::arg("owner"), py::arg("parameters"), py::arg("frames"), py::arg("first"),
      py::arg("follows_loads") = false,
      "An effect whose basis stands in Samples.table from column `first` on, (frame, parameter, 6); parameters: (name, "
      "unit, sigma, doc).");
}

}  // namespace fastcal
