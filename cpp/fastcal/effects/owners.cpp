// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/owners.hpp"

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

std::vector<std::string> numbered(const std::string& prefix, int count) {
  std::vector<std::string> out;
  for (int i = 1; i <= count; ++i) out.push_back(prefix + std::to_string(i));
  return out;
}

}  // namespace

std::vector<std::string> joint_owners(const RobotModel& robot) { return numbered("joint", robot.joint_count()); }

std::vector<std::string> link_owners(const RobotModel& robot) { return numbered("link", robot.joint_count()); }

int owner_index(const std::string& effect, const std::string& prefix, const std::string& owner, int count) {
  for (int i = 0; i < count; ++i) {
    if (owner == prefix + std::to_string(i + 1)) return i;
  }
  FASTCAL_CHECK(false) << effect << " is owned by " << prefix << "1 to " << prefix << count << ", got '" << owner << "'";
  return -1;
}

void check_options(const std::string& effect, const Options& options, const std::set<std::string>& known) {
  for (const auto& [key, value] : options) {
    if (known.count(key) > 0) continue;
    std::string names;
    for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
    FASTCAL_CHECK(false) << effect << " has no option '" << key << "'; " << (names.empty() ? "it has none" : "there are " + names);
  }
}

double number_option(const Options& options, const std::string& key, double fallback) {
  const auto found = options.find(key);
  if (found == options.end()) return fallback;
  const double* value = std::get_if<double>(&found->second);
  FASTCAL_CHECK(value != nullptr) << "option '" << key << "' must be a number";
  return *value;
}

std::string text_option(const Options& options, const std::string& key, const std::string& fallback) {
  const auto found = options.find(key);
  if (found == options.end()) return fallback;
  const std::string* value = std::get_if<std::string>(&found->second);
  FASTCAL_CHECK(value != nullptr) << "option '" << key << "' must be a word";
  return *value;
}

std::vector<double> list_option(const Options& options, const std::string& key) {
  const auto found = options.find(key);
  if (found == options.end()) return {};
  if (const double* one = std::get_if<double>(&found->second)) return {*one};
  const auto* value = std::get_if<std::vector<double>>(&found->second);
  FASTCAL_CHECK(value != nullptr) << "option '" << key << "' must be a list of numbers";
  return *value;
}

}  // namespace fastcal
