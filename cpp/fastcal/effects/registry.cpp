// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/registry.hpp"

#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

std::map<std::string, EffectEntry>& entries() {
  static std::map<std::string, EffectEntry> map;  // in a function: ready before the first registration
  return map;
}

}  // namespace

bool register_effect(const std::string& name, EffectEntry entry) {
  FASTCAL_CHECK(entries().emplace(name, std::move(entry)).second)
      << "the effect name '" << name << "' is registered twice";
  return true;
}

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const auto& [name, entry] : entries()) names.push_back(name);
  return names;
}

const EffectEntry& effect_entry(const std::string& name) {
  const auto found = entries().find(name);
  if (found == entries().end()) {
    std::string known;
    for (const auto& [other, entry] : entries()) known += (known.empty() ? "" : ", ") + other;
    FASTCAL_CHECK(false) << "no effect is called '" << name << "'; there are: geometry" << (known.empty() ? "" : ", ")
                         << known;
  }
  return found->second;
}

std::shared_ptr<const Effect> make_effect(const std::string& name, const RobotModel& robot, const std::string& owner,
                                          const Options& options) {
  FASTCAL_CHECK(robot.tree().is_arm()) << "effect " << name << " acts on one arm, got a tree of frames";
  std::shared_ptr<const Effect> effect = effect_entry(name).make(robot, owner, options);
  FASTCAL_CHECK(robot.description().passive.empty() || !effect->is_weight())
      << "effect " << name << " is of an arm without closed loops";
  const bool is_plain = robot.tree().is_serial() && robot.description().passive.empty();
  FASTCAL_CHECK(is_plain || name != "gravity_sag")
      << "effect " << name << " is of an arm without branches and closed loops";
  return effect;
}

}  // namespace fastcal
