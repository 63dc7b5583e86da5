// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/owners.hpp"

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr const char* kArrow = "<-";

std::vector<std::string> numbered(const std::string& prefix, int count) {
  std::vector<std::string> out;
  for (int i = 1; i <= count; ++i) out.push_back(prefix + std::to_string(i));
  return out;
}

}  // namespace

std::vector<std::string> joint_owners(const RobotModel& robot) { return numbered("joint", robot.joint_count()); }

std::vector<std::string> link_owners(const RobotModel& robot) { return numbered("link", robot.joint_count()); }

std::vector<std::string> joint_pair_owners(const RobotModel& robot) {
  std::vector<std::string> out;
  for (const std::string& driven : joint_owners(robot)) {
    for (const std::string& source : joint_owners(robot)) {
      if (driven == source) continue;
      out.push_back(driven);
      out.back().append(kArrow).append(source);
    }
  }
  return out;
}

std::vector<std::string> long_link_owners(const RobotModel& robot) {
  std::vector<std::string> out;
  for (int i = 0; i < robot.joint_count(); ++i) {
    if (!robot.link_axis(i).isZero(0)) out.push_back("link" + std::to_string(i + 1));
  }
  return out;
}

std::vector<std::string> revolute_owners(const RobotModel& robot) {
  std::vector<std::string> out;
  for (int i = 0; i < robot.joint_count(); ++i) {
    if (robot.description().joint_types[static_cast<std::size_t>(i)] == JointType::kRevolute)
      out.push_back("joint" + std::to_string(i + 1));
  }
  return out;
}

std::vector<std::string> frame_owners(const RobotModel& robot) {
  std::vector<std::string> out;
  out.reserve(static_cast<std::size_t>(robot.frame_count()));
  for (int f = 0; f < robot.frame_count(); ++f) out.push_back(robot.frame_name(f));
  return out;
}

std::function<std::vector<std::string>(const RobotModel&)> single_owner(const std::string& owner) {
  return [owner](const RobotModel&) { return std::vector<std::string>{owner}; };
}

Vector6d base_motion(const State& state, int axis, double amount) {
  Vector6d xi = Vector6d::Zero();
  const Eigen::Vector3d direction = amount * state.chain->constants[kBaseFrame].R.transpose().col(axis % 3);
  (axis < 3 ? xi.head<3>() : xi.tail<3>()) = direction;
  return xi;
}

int frame_index(const std::string& effect, const std::string& owner, const RobotModel& robot) {
  for (int f = 0; f < robot.frame_count(); ++f) {
    if (robot.frame_name(f) == owner) return f;
  }
  FASTCAL_CHECK(false) << effect << " is owned by base, joint1 to joint" << robot.joint_count() << ", link1 to link"
                       << robot.joint_count() << " or tool, got '" << owner << "'";
  return -1;
}

void check_owner(const std::string& effect, const std::string& owner, const std::string& expected) {
  FASTCAL_CHECK(owner == expected) << effect << " is owned by " << expected << ", got '" << owner << "'";
}

int owner_index(const std::string& effect, const std::string& prefix, const std::string& owner, int count) {
  for (int i = 0; i < count; ++i) {
    if (owner == prefix + std::to_string(i + 1)) return i;
  }
  FASTCAL_CHECK(false) << effect << " is owned by " << prefix << "1 to " << prefix << count << ", got '" << owner
                       << "'";
  return -1;
}

std::pair<int, int> joint_pair(const std::string& effect, const std::string& owner, int count) {
  const std::size_t arrow = owner.find(kArrow);
  FASTCAL_CHECK(arrow != std::string::npos)
      << effect << " is owned by a pair such as joint6<-joint5, got '" << owner << "'";
  const int driven = owner_index(effect, "joint", owner.substr(0, arrow), count);
  const int source = owner_index(effect, "joint", owner.substr(arrow + 2), count);
  FASTCAL_CHECK(driven != source) << effect << " joins two joints, got '" << owner << "'";
  return {driven, source};
}

void check_options(const std::string& effect, const Options& options, const std::set<std::string>& known) {
  for (const auto& [key, value] : options) {
    if (known.count(key) > 0) continue;
    std::string names;
    for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
    FASTCAL_CHECK(false) << effect << " has no option '" << key << "'; "
                         << (names.empty() ? "it has none" : "there are " + names);
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
