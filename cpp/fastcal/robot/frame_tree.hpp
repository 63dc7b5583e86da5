// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A tree of frames in depth-first order: a frame stands behind its parent, and all that it carries stands behind it
// without a gap. What a twist of frame f moves is then a range, f ... end - 1, and what weighs on f weighs there.
//   T_f = T_parent(f) C_f Z_f(q) exp(xi_f)
// A branch is a run of frames whose parents are the frames before them: an arm from its base to its tool, or one frame
// alone, a target or an instrument. A serial arm is the tree of one branch.
#pragma once

#include <string>
#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

constexpr int kWorldFrame = -1;  ///< the measuring frame: no effect moves it
constexpr int kBaseFrame = 0;
constexpr int joint_frame(int joint) { return 2 * joint + 1; }  ///< of a serial arm; joint counts from 0
constexpr int link_frame(int joint) { return 2 * joint + 2; }
constexpr int tool_frame(int joint_count) { return 2 * joint_count + 1; }

/// Which frame is read, and from which.
struct View {
  int target = kWorldFrame;
  int sensor = kWorldFrame;
};

/// T_sensor_target.
Pose seen(const View& view, const std::vector<Pose>& T_world_frame);

/// A run of frames, joints and parameters of a robot.
struct Branch {
  std::string name;          ///< empty where it is the whole robot
  int parent = kWorldFrame;  ///< the frame that its first one stands on
  int first_frame = 0, frame_count = 0;
  int first_joint = 0, joint_count = 0;
  int first_parameter = 0, parameter_count = 0;
  int arm = -1;  ///< counts, from 0, the robots whose flange and tool are its last two frames; -1: not those of any

  int end() const { return first_frame + frame_count; }
};

/// Const once built.
class FrameTree {
 public:
  FrameTree() = default;
  /// The frames of an arm: base, joint1, link1, ... , tool.
  explicit FrameTree(int joint_count);
  /// The frames of an arm that branches: of each joint the joint on whose link it stands, -1: on the base. In
  /// depth-first order; the tool is on the last link. Joint i has frame joint_frame(i) here too.
  explicit FrameTree(const std::vector<int>& parents);

  /// Adds a branch behind all others, an arm where `has_tool`; its parent has to be a frame of the branch before or one
  /// that this stands on. Throws InvalidInput where the order would not be depth-first or a name is taken.
  void add(Branch branch, const std::vector<std::string>& names, const std::vector<int>& joints, bool has_tool);

  int frame_count() const { return static_cast<int>(parents_.size()); }
  int joint_count() const { return static_cast<int>(frames_of_joints_.size()); }
  int arm_count() const { return arm_count_; }
  int parent(int frame) const { return parents_[static_cast<std::size_t>(frame)]; }
  /// One past the last frame that `frame` carries.
  int end(int frame) const { return ends_[static_cast<std::size_t>(frame)]; }
  bool carries(int frame, int other) const { return frame <= other && other < end(frame); }
  /// The joint that moves the frame along or about its z, counted in the whole tree; -1: none.
  int joint(int frame) const { return joints_[static_cast<std::size_t>(frame)]; }
  /// The frame that a joint moves.
  int frame_of_joint(int joint) const { return frames_of_joints_[static_cast<std::size_t>(joint)]; }
  const std::string& name(int frame) const { return names_[static_cast<std::size_t>(frame)]; }
  /// The frame of this name; "world" is kWorldFrame. Throws InvalidInput, with the names that there are.
  int frame(const std::string& name) const;
  /// "TARGET" or "TARGET:SENSOR".
  View view(const std::string& names) const;

  const std::vector<Branch>& branches() const { return branches_; }
  bool is_serial() const { return branches_.size() <= 1; }
  /// One robot, base first and tool last, whose joints have the frames that joint_frame() says.
  bool is_arm() const { return is_serial() || is_arm_; }
  /// Does a joint stand at the end of the link before, on which no other stands?
  bool follows(int joint) const;

 private:
  std::vector<int> parents_, ends_, joints_, frames_of_joints_;
  std::vector<std::string> names_;
  std::vector<Branch> branches_;
  int arm_count_ = 0;
  bool is_arm_ = false;
};

}  // namespace fastcal
