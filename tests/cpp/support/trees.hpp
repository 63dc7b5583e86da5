// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Random trees of frames.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "support/robots.hpp"

namespace fastcal::test {

/// Arms of all kinds with bodies, each on the world or on any frame of one before it, and a target and a camera on some
/// of their frames.
inline std::vector<Member> random_members(Random& random, int arms) {
  std::vector<Member> out;
  std::vector<std::string> frames{"world"};
  const auto any = [&](int from) {
    return frames[static_cast<std::size_t>(random.whole(from, static_cast<int>(frames.size()) - 1))];
  };
  for (int a = 0; a < arms; ++a) {
    const Tables tables = random_tables(random, random.whole(1, 3));
    const RobotModel bare = build(kKinds4[static_cast<std::size_t>(a % 4)], tables);
    RobotDescription description = bare.description();
    for (Body& body : description.bodies) body = {random.uniform(1, 9), random.vector(0.3), Eigen::Matrix3d::Zero()};
    description.p_flange_payload = random.vector(0.3);
    Member member;
    member.name = "arm" + std::to_string(a);
    member.robot =
        std::make_shared<const RobotModel>(build(kKinds4[static_cast<std::size_t>(a % 4)], tables, &description));
    member.on = a == 0 ? "world" : any(0);
    for (int f = 0; f < member.robot->frame_count(); ++f)
      frames.push_back(member.name + "." + member.robot->frame_name(f));
    out.push_back(member);
  }
  out.push_back({"target", nullptr, random.pose(1), any(1)});
  out.push_back({"camera", nullptr, random.pose(1), any(1)});
  return out;
}

}  // namespace fastcal::test
