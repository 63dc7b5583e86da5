// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/surrogate_inputs.hpp"

#include <sstream>

#include "fastcal/effects/sight.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

/// The number behind a word, from 0; -1 where the name is another's.
int numbered(const std::string& name, const std::string& word, int count) {
  for (int i = 0; i < count; ++i) {
    if (name == word + std::to_string(i + 1)) return i;
  }
  return -1;
}

double number_at(const double* values, int i) { return values != nullptr ? values[i] : 0; }

}  // namespace

SurrogateInput surrogate_input(const std::string& name, const RobotModel& robot) {
  const int n = robot.joint_count();
  const int tool = tool_frame(n);
  if (const int i = numbered(name, "q", n); i >= 0) return {[i](const State& s) { return s.q[i]; }, kNothing};
  if (const int i = numbered(name, "load", n); i >= 0) {
    const JointType type = robot.description().joint_types[static_cast<std::size_t>(i)];
    return {[i, type](const State& s) { return s.joint_load(s.load, i, type); }, kLoads};
  }
  if (const int i = numbered(name, "approach", n); i >= 0)
    return {[i](const State& s) { return number_at(s.approach, i); }, kNothing, name};
  if (name.rfind("extra:", 0) == 0) {
    const int i = std::stoi(name.substr(6));
    return {[i](const State& s) { return number_at(s.extra, i); }, kNothing};
  }
  if (name == "payload") return {[](const State& s) { return s.payload; }, kNothing};
  if (name == "time") return {[](const State& s) { return s.time; }, kNothing, name};
  if (name == "temperature") return {[](const State& s) { return s.temperature; }, kNothing, name};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string word = kAxes[axis];
    const auto down = [tool, axis](const State& s) {
      return s.frames[tool].R.col(axis).dot(Eigen::Map<const Eigen::Vector3d>(s.gravity).normalized());
    };
    if (name == "gravity_" + word) return {down, kFrames};
    if (name == "weight_" + word) return {[down](const State& s) { return s.payload * down(s); }, kFrames};
    if (name == "sight_" + word)
      return {
          [tool, axis](const State& s) { return s.frames[tool].R.col(axis).dot(Sight(s.frames[tool].p).outward()); },
          kFrames};
    for (int i = 0; i < n; ++i) {
      if (name == "down" + std::to_string(i + 1) + "_" + word)
        return {
            [i, axis](const State& s) {
              return s.frames[link_frame(i)].R.col(axis).dot(Eigen::Map<const Eigen::Vector3d>(s.gravity).normalized());
            },
            kFrames};
    }
    if (name == word) return {[tool, axis](const State& s) { return s.frames[tool].p[axis]; }, kFrames};
    if (name == "forward_" + word && axis < 2)
      return {[tool, axis](const State& s) { return Sight(s.frames[tool].p).forward[axis]; }, kFrames};
  }
  if (name == "height") return {[tool](const State& s) { return Sight(s.frames[tool].p).outward().z(); }, kFrames};
  if (name == "range") return {[tool](const State& s) { return Sight(s.frames[tool].p).range; }, kFrames};
  FASTCAL_CHECK(false) << "surrogate: '" << name << "' is no input of a robot with " << n << " joints";
  return {};
}

std::vector<SurrogateInput> surrogate_inputs(const std::string& names, const RobotModel& robot) {
  std::vector<SurrogateInput> out;
  std::istringstream words(names);
  for (std::string word; words >> word;) out.push_back(surrogate_input(word, robot));
  return out;
}

}  // namespace fastcal
