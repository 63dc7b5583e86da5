// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Names to effects. An effect registers itself in its own file; nothing else needs editing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "fastcal/effects/effect.hpp"
#include "fastcal/effects/traits.hpp"

namespace fastcal {

/// An option of an effect, as it stands behind a colon on the command line or in the robot file.
using Option = std::variant<double, std::string, std::vector<double>>;
using Options = std::map<std::string, Option>;

/// Builds the effect for one owner ("joint2", "link3", "base"); throws InvalidInput on an owner or option that it does
/// not know.
using EffectMaker =
    std::function<std::shared_ptr<const Effect>(const RobotModel&, const std::string& owner, const Options&)>;

/// What the tools that iterate the registry ask of a name.
struct EffectEntry {
  EffectMaker make;
  std::function<std::vector<std::string>(const RobotModel&)> owners;  ///< all owners that this robot has for it
  Traits traits;
};

/// Registered names, sorted.
std::vector<std::string> effect_names();
const EffectEntry& effect_entry(const std::string& name);
std::shared_ptr<const Effect> make_effect(const std::string& name, const RobotModel& robot, const std::string& owner,
                                          const Options& options);

/// Returns true, so that a namespace-scope constant can call it.
bool register_effect(const std::string& name, EffectEntry entry);

}  // namespace fastcal

// Numbered, since several effects may be compiled as one file.
#define FASTCAL_JOINED_NAME(a, b) a##b
#define FASTCAL_NUMBERED_NAME(a, b) FASTCAL_JOINED_NAME(a, b)
#define FASTCAL_REGISTER_EFFECT(name, ...)                                                                        \
  namespace {                                                                                                     \
  [[maybe_unused]] const bool FASTCAL_NUMBERED_NAME(kRegistered,                                                  \
                                                    __COUNTER__) = ::fastcal::register_effect(name, __VA_ARGS__); \
  }
