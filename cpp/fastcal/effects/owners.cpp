// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/owners.hpp"

#include <algorithm>

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

std::vector<std::string> pin_owners(const RobotModel& robot) {
  const RobotDescription& of = robot.description();
  const auto parent = [&of](int joint) {
    return of.parents.empty() ? joint - 1 : of.parents[static_cast<std::size_t>(joint)];
  };
  // A link without mass, pins and length stands between hinges or slides that are one joint, as a ball's.
  const auto is_there = [&](int link) {
    if (link < 0 || link == robot.joint_count() - 1 || of.bodies[static_cast<std::size_t>(link)].mass > 0) return true;
    const bool is_pinned = std::any_of(of.loops.begin(), of.loops.end(), [link](const Loop& loop) {
      return loop.frames.target == link_frame(link) || loop.frames.sensor == link_frame(link);
    });
    // Of a urdf the way to the next joint stands in the link's frame where that joint is alone on it.
    bool is_long = !robot.chain().constants[static_cast<std::size_t>(link_frame(link))].p.isZero();
    int on_it = 0;
    for (int joint = link + 1; joint < robot.joint_count(); ++joint) {
      if (parent(joint) != link) continue;
      ++on_it;
      is_long = is_long || !robot.chain().constants[static_cast<std::size_t>(joint_frame(joint))].p.isZero();
    }
    return is_pinned || is_long || on_it > 1;
  };
  std::vector<std::string> out;
  for (const int joint : of.passive) {
    const bool turns = of.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute;
    if (turns && is_there(parent(joint)) && is_there(joint)) out.push_back("joint" + std::to_string(joint + 1));
  }
  return out;
}

std::vector<std::string> rod_owners(const RobotModel& robot) {
  std::vector<std::string> out;
  for (const Loop& loop : robot.description().loops) {
    if (loop.kind == Loop::Kind::kRod) out.push_back(loop.name);
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

int rod_index(const std::string& effect, const std::string& owner, const RobotModel& robot) {
  const std::vector<Loop>& loops = robot.description().loops;
  const auto rod = std::find_if(loops.begin(), loops.end(), [&owner](const Loop& loop) {
    return loop.kind == Loop::Kind::kRod && loop.name == owner;
  });
  FASTCAL_CHECK(rod != loops.end()) << effect << " is owned by a rod of a closed loop, got '" << owner << "'";
  return robot.frame_count() + static_cast<int>(rod - loops.begin());
}

int pin_index(const std::string& effect, const std::string& owner, const RobotModel& robot) {
  const std::vector<std::string> pins = pin_owners(robot);
  const int joint = owner_index(effect, "joint", owner, robot.joint_count());
  FASTCAL_CHECK(std::find(pins.begin(), pins.end(), owner) != pins.end())
      << effect << " is owned by a passive joint that turns, got '" << owner << "'";
  return joint;
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
