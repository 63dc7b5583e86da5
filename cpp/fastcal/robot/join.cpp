// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Robots, targets and instruments as one tree: each member's frames, joints and parameters follow each other as they do
// in the robot that it was, and what stands on a frame comes behind all that stands on the frames beyond it.
#include <algorithm>
#include <limits>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/robot/robot_model.hpp"
#include "fastcal/robot/statics.hpp"

namespace fastcal {
namespace {

// How readily the gauge holds where a member stands, as fixing_priority() has it for base and tool.
constexpr double kHoldBase = 2e-5, kHoldPosition = 1e-3, kHoldRotation = 1e-2;

/// The frames of a member by the names that they have in the tree.
std::vector<std::string> frame_names(const Member& member) {
  if (member.robot == nullptr) return {member.name};
  std::vector<std::string> out;
  for (int f = 0; f < member.robot->frame_count(); ++f) out.push_back(member.name + "." + member.robot->frame_name(f));
  return out;
}

/// Members in the order of their frames; those that stand on nothing that stands on the world are left out.
void visit(const std::vector<Member>& members, const std::string& frame, std::vector<std::size_t>& order) {
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (members[m].on != frame || std::find(order.begin(), order.end(), m) != order.end()) continue;
    order.push_back(m);
    std::vector<std::string> own = frame_names(members[m]);
    for (auto name = own.rbegin(); name != own.rend(); ++name) visit(members, *name, order);
  }
}

std::vector<std::size_t> depth_first(const std::vector<Member>& members) {
  std::vector<std::size_t> order;
  visit(members, "world", order);
  std::vector<std::string> names{"world"};
  for (const Member& member : members) {
    for (const std::string& name : frame_names(member)) names.push_back(name);
  }
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (std::find(order.begin(), order.end(), m) != order.end()) continue;
    const bool known = std::find(names.begin(), names.end(), members[m].on) != names.end();
    FASTCAL_CHECK(known) << "'" << members[m].name << "' stands on '" << members[m].on
                         << "', and there is no such frame";
    FASTCAL_CHECK(false) << "'" << members[m].name << "' stands on '" << members[m].on
                         << "', which in the end stands on '" << members[m].name << "' itself";
  }
  return order;
}

}  // namespace

RobotModel join(const std::vector<Member>& members) {
  const std::vector<std::size_t> order = depth_first(members);
  const auto first = std::find_if(order.begin(), order.end(), [&](auto m) { return members[m].robot != nullptr; });
  FASTCAL_CHECK(first != order.end()) << "a tree of frames needs at least one robot, got none";
  RobotModel out = *members[*first].robot;
  auto tree = std::make_shared<FrameTree>();
  out.steps_.clear();
  out.parameters_.clear();
  out.nominal_.resize(0);
  out.link_axes_.clear();
  RobotDescription& whole = out.description_;
  whole.gravity = gravity_in_world(whole, whole.T_world_base);
  whole.gravity_in_world = true;
  whole.joint_types.clear();
  whole.bodies.clear();
  whole.compensator.reset();
  whole.T_world_base = whole.T_flange_tool = Pose();
  whole.hands.clear();
  std::vector<double> ratios;
  Eigen::Index joints = 0;
  for (const std::size_t m : order) joints += members[m].robot == nullptr ? 0 : members[m].robot->joint_count();
  whole.coupling = Eigen::MatrixXd::Zero(joints, joints);
  for (const std::size_t m : order) {
    const Member& member = members[m];
    Branch branch;
    branch.name = member.name;
    branch.parent = tree->frame(member.on);
    branch.first_joint = static_cast<int>(whole.joint_types.size());
    branch.first_parameter = static_cast<int>(out.parameters_.size());
    out.steps_.push_back({RobotModel::StepKind::kBranch, Motion::kTx, branch.parent, 1, {}});
    std::vector<int> joint_of;
    if (member.robot == nullptr) {
      out.add_frame_parameters(member.name, member.T_on_frame, RobotModel::StepKind::kConstant);
      out.steps_.push_back({RobotModel::StepKind::kFrame, Motion::kTx, -1, 1, {}});
      branch.parameter_count = 6;
      joint_of.push_back(-1);
    } else {
      const RobotModel& robot = *member.robot;
      const RobotDescription& own = robot.description_;
      FASTCAL_CHECK(robot.tree().is_serial()) << "'" << member.name << "' is a tree itself; expected one arm";
      FASTCAL_CHECK(own.passive.empty()) << "'" << member.name
                                         << "' has closed loops, which a robot has that stands alone";
      FASTCAL_CHECK(own.bending == nullptr) << "'" << member.name << "' has beams, which a robot has that stands alone";
      whole.hands.push_back(own);
      branch.joint_count = robot.joint_count();
      branch.parameter_count = static_cast<int>(robot.parameters_.size());
      for (RobotModel::Step step : robot.steps_) {
        if (step.parameter >= 0) step.parameter += branch.first_parameter;
        out.steps_.push_back(step);
      }
      for (Parameter parameter : robot.parameters_) {
        parameter.owner = member.name + "." + parameter.owner;
        out.parameters_.push_back(std::move(parameter));
      }
      out.nominal_.conservativeResize(out.nominal_.size() + robot.nominal_.size());
      out.nominal_.tail(robot.nominal_.size()) = robot.nominal_;
      whole.joint_types.insert(whole.joint_types.end(), own.joint_types.begin(), own.joint_types.end());
      whole.bodies.insert(whole.bodies.end(), own.bodies.begin(), own.bodies.end());
      const Eigen::Index n = own.coupling.rows();
      whole.coupling.block(branch.first_joint, branch.first_joint, n, n) = own.coupling;
      for (int j = 0; j < robot.joint_count(); ++j) {
        out.link_axes_.push_back(robot.link_axis(j));
        ratios.push_back(own.motor_ratio.size() > 0 ? own.motor_ratio[j] : std::numeric_limits<double>::quiet_NaN());
      }
      if (own.compensator) {
        FASTCAL_CHECK(!whole.compensator) << "'" << member.name << "' is the second robot with a compensator";
        whole.compensator = own.compensator;
        whole.compensator->joint += branch.first_joint;
      }
      for (int f = 0; f < robot.frame_count(); ++f) {
        const int joint = robot.tree().joint(f);
        joint_of.push_back(joint < 0 ? -1 : branch.first_joint + joint);
      }
    }
    // Where the member stands comes first of its parameters, a robot's tool last.
    const auto place = [&](int from, double hold_position, double hold_rotation) {
      for (int k = 0; k < 6; ++k)
        out.parameters_[static_cast<std::size_t>(from + k)].hold = k < 3 ? hold_position : hold_rotation;
    };
    const int from = branch.first_parameter;
    if (member.robot != nullptr && branch.parent == kWorldFrame)
      place(from, kHoldBase, kHoldBase);
    else
      place(from, kHoldPosition, kHoldRotation);
    if (member.robot != nullptr) place(from + branch.parameter_count - 6, kHoldPosition, kHoldRotation);
    for (int k = 0; k < 6; ++k)
      out.parameters_[static_cast<std::size_t>(from + k)].sigma = k < 3 ? member.sigma_position : member.sigma_rotation;
    tree->add(std::move(branch), frame_names(member), joint_of, member.robot != nullptr);
    if (m == *first) out.tool_ = tree->branches().back().end() - 1;
  }
  whole.motor_ratio = Eigen::Map<const Eigen::VectorXd>(ratios.data(), static_cast<Eigen::Index>(ratios.size()));
  out.joints_added_ = static_cast<int>(joints);
  out.tree_ = std::move(tree);
  return out;
}

}  // namespace fastcal
