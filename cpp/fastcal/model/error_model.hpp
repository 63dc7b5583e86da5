// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A robot with its effects: predicts the tool's pose and its derivative by every parameter.
//   J_tool_theta = J_tool_xi * J_xi_theta, inner names cancel: the chain gives the first factor, geometry and effects
//   the second.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "fastcal/effects/effect.hpp"
#include "fastcal/robot/assembly.hpp"

namespace fastcal {

/// What decides the equilibrium of an arm of springs and weights.
struct JointSprings {
  Eigen::VectorXd compliance;  ///< (n) of the joints [rad/(N m), m/N]
  Weights weights;             ///< what effects add to those of the robot file
};

/// Parameters: the robot's own (RobotModel::parameters), then each effect's in the order given.
class ErrorModel {
 public:
  /// `effect_values`: where the effects' parameters start, all of them in order; empty: at zero.
  explicit ErrorModel(RobotModel robot, std::vector<std::shared_ptr<const Effect>> effects = {},
                      const Eigen::VectorXd& effect_values = {});

  const RobotModel& robot() const { return robot_; }
  const std::vector<std::shared_ptr<const Effect>>& effects() const { return effects_; }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  /// What the effects need that settle() must compute: bits of Need.
  unsigned needs() const { return needs_; }
  /// Loads are taken in the deflected posture, at equilibrium; false: in the undeflected one, to first order.
  bool at_equilibrium() const { return at_equilibrium_; }
  ErrorModel with_equilibrium(bool at_equilibrium) const;
  /// Where springs and the weights of the arm and its payload alone decide the equilibrium; nothing where anything else
  /// looks at loads or puts some on the arm.
  std::optional<JointSprings> springs(const Eigen::Ref<const Eigen::VectorXd>& theta) const;
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  /// The robot's own values and the effects' starting values.
  const Eigen::VectorXd& start() const { return start_; }
  /// The same effects, starting at the same values, on another robot of the same parameters.
  ErrorModel with_robot(RobotModel robot) const;

 private:
  RobotModel robot_;
  std::vector<std::shared_ptr<const Effect>> effects_;
  std::vector<Parameter> parameters_;
  Eigen::VectorXd start_;
  unsigned needs_ = kNothing;
  bool at_equilibrium_ = true;
};

/// Evaluates an ErrorModel at one parameter vector, row after row; one a thread.
class RowEvaluator {
 public:
  RowEvaluator(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta);
  RowEvaluator(const RowEvaluator&) = delete;
  RowEvaluator& operator=(const RowEvaluator&) = delete;

  /// Pose of the tool in the measuring frame.
  const Pose& pose(const State& state) { return frames(state)[static_cast<std::size_t>(model_.robot().view().target)]; }

  /// The pose, and J (6 x P) = d [v; w] / d theta: motion of the tool in the axes of the measuring frame.
  const Pose& jacobian(const State& state, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J);

  /// T_sensor_target, and J (6 x P): motion of the target in the axes of the sensor's frame, as it is seen from there.
  Pose jacobian(const State& state, const View& view, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J);

  /// Poses of all frames, and what motion() needs.
  const std::vector<Pose>& columns(const State& state);
  /// J (6 x P) of a frame's origin as columns() left it: effects' twists of it and of the frames before, and geometry
  /// before it.
  void motion(int frame, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) const;

  /// Poses of all frames, with (default) or without the effects' twists. `again`: only what settle() computes of the
  /// row has changed since its last evaluation, so that effects without needs stay as they are.
  const std::vector<Pose>& frames(const State& state, bool deflected = true, bool again = false);

  /// Joint positions (n) of the last row, the passive ones where its loops closed.
  const std::vector<double>& joints() const { return q_; }
  /// The equations of its loops, and their derivative by the passive joints.
  const Assembler& loops() const { return *assembler_; }

 private:
  void evaluate(const State& state, bool again);
  /// Adds the twists of the effects that have needs, or of those that have none, to `xi`.
  void deflect(const State& state, bool with_needs, Twists& xi) const;
  /// Poses of all frames with these twists (or null), loops closed.
  void find_frames(const State& state, const Twists* xi);
  /// What every parameter makes the passive joints do (passive, P), after columns().
  void follow_loops();
  /// motion() with the passive joints held.
  void open_motion(int frame, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) const;

  const ErrorModel& model_;
  Eigen::VectorXd theta_;
  Chain chain_;
  Twists xi_, steady_;    // of all effects, and of those without needs
  TwistColumns columns_;  // of the effects, this row
  std::vector<Pose> frames_;
  std::vector<double> q_;
  std::optional<Assembler> assembler_;
  Eigen::MatrixXd passive_;  // (passive, P)
};

}  // namespace fastcal
