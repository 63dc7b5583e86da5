// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/frame_tree.hpp"

#include <algorithm>
#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {

Pose seen(const View& view, const std::vector<Pose>& T_world_frame) {
  const auto pose = [&](int frame) { return frame == kWorldFrame ? Pose() : T_world_frame[std::size_t(frame)]; };
  return view.sensor == kWorldFrame ? pose(view.target) : pose(view.sensor).inverse() * pose(view.target);
}

FrameTree::FrameTree(int joint_count) {
  std::vector<std::string> names{"base"};
  std::vector<int> joints{-1};
  for (int j = 0; j < joint_count; ++j) {
    const std::string number = std::to_string(j + 1);
    names.insert(names.end(), {"joint" + number, "link" + number});
    joints.insert(joints.end(), {j, -1});
  }
  names.emplace_back("tool");
  joints.push_back(-1);
  add({"", kWorldFrame, 0, static_cast<int>(names.size()), 0, joint_count}, names, joints, true);
}

FrameTree::FrameTree(const std::vector<int>& parents) : is_arm_(true) {
  const int n = static_cast<int>(parents.size());
  std::vector<int> children(parents.size() + 1, 0);
  for (int j = 0; j < n; ++j) {
    const int parent = parents[static_cast<std::size_t>(j)];
    FASTCAL_CHECK(parent >= -1 && parent < j) << "joint" << j + 1 << " must stand on the base or on a joint before it";
    ++children[static_cast<std::size_t>(parent + 1)];
  }
  std::vector<std::string> names{"base"};
  std::vector<int> joints{-1};
  Branch branch;
  for (int j = 0; j < n; ++j) {
    const int parent = parents[static_cast<std::size_t>(j)];
    const bool first_on_base = j == 0 && children[0] == 1;
    if (!first_on_base && (parent != j - 1 || children[static_cast<std::size_t>(j)] != 1)) {
      branch.joint_count = j - branch.first_joint;
      add(branch, names, joints, false);
      names.clear();
      joints.clear();
      branch = {"joint" + std::to_string(j + 1), parent < 0 ? kBaseFrame : link_frame(parent), 0, 0, j, 0};
    }
    const std::string number = std::to_string(j + 1);
    names.insert(names.end(), {"joint" + number, "link" + number});
    joints.insert(joints.end(), {j, -1});
  }
  names.emplace_back("tool");
  joints.push_back(-1);
  branch.joint_count = n - branch.first_joint;
  add(branch, names, joints, true);
}

bool FrameTree::follows(int joint) const {
  const int frame = frame_of_joint(joint);
  return joint > 0 && std::none_of(branches_.begin(), branches_.end(),
                                   [frame](const Branch& branch) { return branch.first_frame == frame; });
}

void FrameTree::add(Branch branch, const std::vector<std::string>& names, const std::vector<int>& joints,
                    bool has_tool) {
  branch.first_frame = frame_count();
  branch.frame_count = static_cast<int>(names.size());
  branch.arm = has_tool ? arm_count_++ : -1;
  const bool is_behind =
      branch.parent == kWorldFrame || (branch.parent < branch.first_frame && end(branch.parent) == branch.first_frame);
  FASTCAL_CHECK(is_behind) << "branch '" << branch.name << "' must stand on the world or on a frame that carries the "
                           << "last frame so far";
  for (std::size_t k = 0; k < names.size(); ++k) {
    FASTCAL_CHECK(names[k] != "world" && std::find(names_.begin(), names_.end(), names[k]) == names_.end())
        << "two frames are named '" << names[k] << "'";
    const int frame = frame_count();
    parents_.push_back(k == 0 ? branch.parent : frame - 1);
    ends_.push_back(frame + 1);
    joints_.push_back(joints[k]);
    names_.push_back(names[k]);
    if (joints[k] >= 0) frames_of_joints_.push_back(frame);
    for (int f = parents_.back(); f != kWorldFrame; f = parent(f)) ends_[static_cast<std::size_t>(f)] = frame + 1;
  }
  branches_.push_back(std::move(branch));
}

int FrameTree::frame(const std::string& name) const {
  if (name == "world") return kWorldFrame;
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) {
    constexpr std::size_t kMostListed = 40;
    std::string known = "world";
    for (std::size_t k = 0; k < std::min(names_.size(), kMostListed); ++k) known += ", " + names_[k];
    FASTCAL_CHECK(false) << "there is no frame '" << name << "'; there are " << known
                         << (names_.size() > kMostListed ? " and more" : "");
  }
  return static_cast<int>(found - names_.begin());
}

View FrameTree::view(const std::string& names) const {
  const std::size_t colon = names.find(':');
  if (colon == std::string::npos) return {frame(names), kWorldFrame};
  return {frame(names.substr(0, colon)), frame(names.substr(colon + 1))};
}

}  // namespace fastcal
