// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What the makers of effects share: reading owners and options, with one clear sentence where they do not fit.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "fastcal/effects/registry.hpp"

namespace fastcal {

/// Makes an effect of class T from (robot, owner, options).
template <typename T>
std::shared_ptr<const Effect> make(const RobotModel& robot, const std::string& owner, const Options& options) {
  return std::make_shared<const T>(robot, owner, options);
}

/// The body twist of joint_i's frame that moves the joint by dq: about its z axis, or along it.
inline Vector6d joint_motion(const std::vector<JointType>& types, int joint, double dq) {
  Vector6d xi = Vector6d::Zero();
  xi[types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2] = dq;
  return xi;
}

/// "joint1" ... "jointn" / "link1" ... "linkn"
std::vector<std::string> joint_owners(const RobotModel& robot);
std::vector<std::string> link_owners(const RobotModel& robot);

/// Index from 0 of "joint3" or "link3"; throws InvalidInput for another owner.
int owner_index(const std::string& effect, const std::string& prefix, const std::string& owner, int count);

/// Throws InvalidInput where options hold a key that is not in `known`.
void check_options(const std::string& effect, const Options& options, const std::set<std::string>& known);

/// An option as a number, text or list; `fallback` where it is not given; throws InvalidInput where it is of another type.
double number_option(const Options& options, const std::string& key, double fallback);
std::string text_option(const Options& options, const std::string& key, const std::string& fallback);
std::vector<double> list_option(const Options& options, const std::string& key);

}  // namespace fastcal
