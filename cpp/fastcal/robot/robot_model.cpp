// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/robot_model.hpp"

#include <cmath>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {
namespace {

constexpr double kSigmaLength = 1e-3;  // [m], [rad]: sizes of errors of a machined arm; they scale, they do not bind
constexpr double kSigmaAngle = 1e-3;

bool is_rotation(Motion motion) { return motion == Motion::kRx || motion == Motion::kRy || motion == Motion::kRz; }

int axis_of(Motion motion) {
  switch (motion) {
    case Motion::kTx:
    case Motion::kRx:
      return 0;
    case Motion::kTy:
    case Motion::kRy:
      return 1;
    default:
      return 2;
  }
}

/// T exp(value xi) with the unit twist xi of the motion, whose axes are those of T.
void move(Pose& T, Motion motion, double value) {
  const int z = axis_of(motion);
  if (!is_rotation(motion)) {
    T.p += value * T.R.col(z);
    return;
  }
  const int x = (z + 1) % 3;
  const int y = (z + 2) % 3;
  const double c = std::cos(value);
  const double s = std::sin(value);
  const Eigen::Vector3d before = T.R.col(x);
  T.R.col(x) = c * before + s * T.R.col(y);
  T.R.col(y) = c * T.R.col(y) - s * before;
}

/// Ad(T) xi with the unit twist xi of the motion.
Vector6d twist_of(const Pose& T, Motion motion) {
  const auto axis = T.R.col(axis_of(motion));
  Vector6d xi = Vector6d::Zero();
  if (is_rotation(motion))
    xi << T.p.cross(axis), axis;
  else
    xi.head<3>() = axis;
  return xi;
}

bool is_finite(const Pose& pose) { return pose.R.allFinite() && pose.p.allFinite(); }

}  // namespace

RobotModel::RobotModel(RobotDescription description) : description_(std::move(description)) {
  const int n = joint_count();
  FASTCAL_CHECK(n > 0) << "a robot needs at least one joint, got none";
  if (description_.bodies.empty()) description_.bodies.resize(static_cast<std::size_t>(n));
  FASTCAL_CHECK(static_cast<int>(description_.bodies.size()) == n)
      << "bodies must be one a joint (" << n << "), got " << description_.bodies.size();
  if (description_.coupling.size() == 0) description_.coupling = Eigen::MatrixXd::Zero(n, n);
  FASTCAL_CHECK(description_.coupling.rows() == n && description_.coupling.cols() == n)
      << "coupling must be " << n << " x " << n;
  FASTCAL_CHECK(is_finite(description_.T_world_base) && is_finite(description_.T_flange_tool))
      << "base and tool must be finite";
  FASTCAL_CHECK(description_.gravity.allFinite() && description_.p_flange_payload.allFinite())
      << "gravity and the payload's centre must be finite";
  FASTCAL_CHECK(description_.parents.empty() || static_cast<int>(description_.parents.size()) == n)
      << "parents must be one a joint (" << n << "), got " << description_.parents.size();
  tree_ = description_.parents.empty() ? std::make_shared<const FrameTree>(n)
                                       : std::make_shared<const FrameTree>(description_.parents);
  tool_ = tool_frame(n);
  add_frame_parameters("base", description_.T_world_base, StepKind::kBaseReference);
  steps_.push_back({StepKind::kFrame, Motion::kTx, -1, 1, {}});
}

void RobotModel::add_frame_parameters(const std::string& owner, const Pose& pose, StepKind reference) {
  const std::string whose = reference == StepKind::kBaseReference   ? " of the base in the measuring frame"
                            : reference == StepKind::kToolReference ? " of the tool in the flange frame"
                                                                    : " of it in the frame that it stands on";
  add_parameter(Motion::kTx, pose.p.x(), {owner, "x", "m", kSigmaLength, "position x" + whose});
  add_parameter(Motion::kTy, pose.p.y(), {owner, "y", "m", kSigmaLength, "position y" + whose});
  add_parameter(Motion::kTz, pose.p.z(), {owner, "z", "m", kSigmaLength, "position z" + whose});
  steps_.push_back({reference, Motion::kTx, -1, 1, {pose.R, Eigen::Vector3d::Zero()}});
  add_parameter(Motion::kRx, 0, {owner, "rx", "rad", kSigmaAngle, "turn about its own x" + whose});
  add_parameter(Motion::kRy, 0, {owner, "ry", "rad", kSigmaAngle, "turn about its own y" + whose});
  add_parameter(Motion::kRz, 0, {owner, "rz", "rad", kSigmaAngle, "turn about its own z" + whose});
}

void RobotModel::add_parameter(Motion motion, double value, Parameter parameter, double sign) {
  FASTCAL_CHECK(std::isfinite(value)) << parameter.owner << " " << parameter.name << " must be a finite number, got "
                                      << value;
  const int index = static_cast<int>(parameters_.size());
  parameters_.push_back(std::move(parameter));
  nominal_.conservativeResize(index + 1);
  nominal_[index] = value;
  repeat_parameter(motion, index, sign);
}

void RobotModel::repeat_parameter(Motion motion, int parameter, double sign) {
  steps_.push_back({StepKind::kMotion, motion, parameter, sign, {}});
}

void RobotModel::add_constant(const Pose& pose) {
  FASTCAL_CHECK(is_finite(pose)) << "a fixed frame of the chain must be finite";
  steps_.push_back({StepKind::kConstant, Motion::kTx, -1, 1, pose});
}

void RobotModel::add_joint() {
  ++joints_added_;
  steps_.push_back({StepKind::kJoint, Motion::kTx, -1, 1, {}});
}

void RobotModel::add_body_frame() { steps_.push_back({StepKind::kBodyFrame, Motion::kTx, -1, 1, {}}); }

void RobotModel::add_link_end() { steps_.push_back({StepKind::kFrame, Motion::kTx, -1, 1, {}}); }

void RobotModel::open_branch(int joint, bool ends_link) {
  if (joint == 0 ? tree_->frame_of_joint(0) != tree_->branches().front().end() : follows(joint)) return;
  if (ends_link && joint > 0) add_link_end();
  steps_.push_back({StepKind::kBranch, Motion::kTx, tree_->parent(tree_->frame_of_joint(joint)), 1, {}});
}

void RobotModel::set_link_axis(int joint, const Eigen::Vector3d& axis) {
  link_axes_.resize(static_cast<std::size_t>(joint_count()), Eigen::Vector3d::Zero());
  link_axes_[static_cast<std::size_t>(joint)] = axis;
}

Eigen::Vector3d RobotModel::link_axis(int joint) const {
  const Eigen::Vector3d axis = link_axes_.empty() ? chain().constants[static_cast<std::size_t>(link_frame(joint))].p
                                                  : link_axes_[static_cast<std::size_t>(joint)];
  return axis.norm() < kShortestLink ? Eigen::Vector3d::Zero() : axis;
}

void RobotModel::finish() {
  FASTCAL_CHECK(joints_added_ == joint_count())
      << "the chain has " << joints_added_ << " joints, its description " << joint_count();
  add_loop_parameters();
  add_frame_parameters("tool", description_.T_flange_tool, StepKind::kToolReference);
  steps_.push_back({StepKind::kFrame, Motion::kTx, -1, 1, {}});
  close_loops();
  const Chain whole = chain();
  for (int i = 0; i < joint_count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Body& body = description_.bodies[k];
    if (body.mass == 0 && body.com.isZero(0)) body.com = whole.body_frames[k].inverse() * (0.5 * link_axis(i)).eval();
  }
}

Chain RobotModel::chain(const Eigen::Ref<const Eigen::VectorXd>& values) const {
  FASTCAL_CHECK(values.size() == nominal_.size())
      << "the chain has " << nominal_.size() << " parameters, got " << values.size();
  Chain out;
  out.joint_types = description_.joint_types;
  out.constants.reserve(static_cast<std::size_t>(frame_count()));
  out.columns.reserve(steps_.size());
  out.first_moved.reserve(steps_.size());
  out.tree = tree_;
  out.passive = description_.passive;
  out.loop_rows = loop_rows_;
  out.home = description_.home;
  for (const Loop& loop : description_.loops) out.loops.push_back(loop_at(loop, values));
  Pose local;               // from the last frame passed to here
  int frame = kWorldFrame;  // the last one passed
  for (const Step& step : steps_) {
    switch (step.kind) {
      case StepKind::kBranch:
        frame = step.parameter;
        break;
      case StepKind::kMotion: {
        out.columns.push_back({step.parameter, frame, step.sign * twist_of(local, step.motion)});
        out.first_moved.push_back(static_cast<int>(out.constants.size()));
        move(local, step.motion, step.sign * values[step.parameter]);
        break;
      }
      case StepKind::kConstant:
      case StepKind::kBaseReference:
      case StepKind::kToolReference:
        local = local * step.constant;
        break;
      case StepKind::kBodyFrame:
        out.body_frames.push_back(local);
        break;
      case StepKind::kJoint:
      case StepKind::kFrame:
        frame = static_cast<int>(out.constants.size());
        out.constants.push_back(local);
        local = Pose();
        break;
    }
  }
  return out;
}

RobotModel RobotModel::with_base_and_tool(const Pose& T_world_base, const Pose& T_flange_tool) const {
  FASTCAL_CHECK(tree_->is_arm()) << "expected one arm, got a tree of " << tree_->branches().size() << " branches";
  RobotModel out = *this;
  out.description_.T_world_base = T_world_base;
  out.description_.T_flange_tool = T_flange_tool;
  const auto set = [&out](int first, const Pose& pose) {
    out.nominal_.segment<3>(first) = pose.p;
    out.nominal_.segment<3>(first + 3).setZero();
  };
  set(0, T_world_base);
  set(static_cast<int>(nominal_.size()) - 6, T_flange_tool);
  for (Step& step : out.steps_) {
    if (step.kind == StepKind::kBaseReference) step.constant.R = T_world_base.R;
    if (step.kind == StepKind::kToolReference) step.constant.R = T_flange_tool.R;
  }
  return out;
}

Eigen::Matrix3d rotation_to_axis(const Eigen::Vector3d& axis) {
  const bool down = axis.z() < -0.9;
  const Eigen::Vector3d from =
      down ? Eigen::Vector3d(-Eigen::Vector3d::UnitZ()) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d V = skew(from.cross(axis));
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity() + V + V * V / (1 + from.dot(axis));
  return down ? Eigen::Matrix3d(R * Eigen::Vector3d(1, -1, -1).asDiagonal()) : R;
}

}  // namespace fastcal
