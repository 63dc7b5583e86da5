// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What the makers of effects share: reading owners and options, with one clear sentence where they do not fit.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fastcal/effects/registry.hpp"

namespace fastcal {

/// Makes an effect of class T from (robot, owner, options).
template <typename T>
std::shared_ptr<const Effect> make(const RobotModel& robot, const std::string& owner, const Options& options) {
  return std::make_shared<const T>(robot, owner, options);
}

/// The part of a twist (of a load) of joint_i's frame that moves the joint: about its z axis, or along it.
inline int joint_part(const std::vector<JointType>& types, int joint) {
  return types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2;
}

/// The body twist of joint_i's frame that moves the joint by dq.
inline Vector6d joint_motion(const std::vector<JointType>& types, int joint, double dq) {
  Vector6d xi = Vector6d::Zero();
  xi[joint_part(types, joint)] = dq;
  return xi;
}

/// The body twist of the base's frame that moves it along (axis 0 to 2) or about (3 to 5) an axis of the measuring
/// frame, about the base's own origin. Needs kFrames.
Vector6d base_motion(const State& state, int axis, double amount);

/// What the parameters of a rigid motion are called: x, y, z [m], rx, ry, rz [rad]; in the order of a twist.
inline constexpr const char* kAxes[6] = {"x", "y", "z", "rx", "ry", "rz"};

/// "joint1" ... "jointn" / "link1" ... "linkn"
std::vector<std::string> joint_owners(const RobotModel& robot);
std::vector<std::string> link_owners(const RobotModel& robot);
/// "joint1<-joint2" ...: every joint with every other one that acts on it.
std::vector<std::string> joint_pair_owners(const RobotModel& robot);
/// Links whose own axis has a length.
std::vector<std::string> long_link_owners(const RobotModel& robot);
std::vector<std::string> revolute_owners(const RobotModel& robot);
/// Pins: joints that turn and that no motor moves.
std::vector<std::string> pin_owners(const RobotModel& robot);
/// Loops that are rods between two balls, by their names.
std::vector<std::string> rod_owners(const RobotModel& robot);
/// Every frame of the chain by its name: "base", "joint1", "link1", ... "tool".
std::vector<std::string> frame_owners(const RobotModel& robot);
/// The one owner of an effect that a robot has but once.
std::function<std::vector<std::string>(const RobotModel&)> single_owner(const std::string& owner);

/// Index from 0 of "joint3" or "link3"; throws InvalidInput for another owner.
int owner_index(const std::string& effect, const std::string& prefix, const std::string& owner, int count);

/// The column of Twists of the rod of that name; throws InvalidInput where it is none.
int rod_index(const std::string& effect, const std::string& owner, const RobotModel& robot);

/// The index from 0 of the pin of that name; throws InvalidInput where it is none.
int pin_index(const std::string& effect, const std::string& owner, const RobotModel& robot);

/// Indices from 0 of the joint that is acted on and of the other one; throws InvalidInput unless these are two joints.
std::pair<int, int> joint_pair(const std::string& effect, const std::string& owner, int count);

/// The frame of that name; throws InvalidInput where there is none.
int frame_index(const std::string& effect, const std::string& owner, const RobotModel& robot);

/// Throws InvalidInput unless the owner is `expected`.
void check_owner(const std::string& effect, const std::string& owner, const std::string& expected);

/// Throws InvalidInput where options hold a key that is not in `known`.
void check_options(const std::string& effect, const Options& options, const std::set<std::string>& known);

/// An option as a number, text or list; `fallback` where it is not given; throws InvalidInput where it is of another
/// type.
double number_option(const Options& options, const std::string& key, double fallback);
std::string text_option(const Options& options, const std::string& key, const std::string& fallback);
std::vector<double> list_option(const Options& options, const std::string& key);

}  // namespace fastcal
