// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Passive joints of a robot with closed loops: e(q_active, q_passive) = 0 by Newton, as many equations as passive
// joints, and their motion by the implicit function theorem, dq_passive = -(de/dq_passive)^-1 de.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "fastcal/robot/kinematics.hpp"

namespace fastcal {

/// One equation of a loop at given frames.
struct LoopRow {
  double value = 0;  ///< [m], [rad]; 0 where the loop is closed
  View frames;
  int rod = -1;                           ///< of a rod: the column of Twists by which effects lengthen it
  Vector6d by_target = Vector6d::Zero();  ///< by [v; w] of the frame's origin, axes of the measuring frame
  Vector6d by_sensor = Vector6d::Zero();
  std::vector<std::pair<int, double>> by_turn;       ///< by the turns of joints
  std::vector<std::pair<int, double>> by_parameter;  ///< by parameters of the loop itself
};

/// The equations that `chain` keeps (Chain::loop_rows), or all of all its loops.
std::vector<LoopRow> loop_rows(const Chain& chain, std::span<const Pose> T_world_frame, const double* q,
                               const Twists* xi, bool all = false);

/// The body twist of a joint's frame by its motion: along or about z, which the frame's own errors `xi` (or null)
/// follow.
Vector6d joint_axis(const Chain& chain, int joint, const Twists* xi);

/// Derivative of an equation by the motion of a joint, whose frame errors `xi` (or null) have moved.
double by_joint(const Chain& chain, const LoopRow& row, std::span<const Pose> T_world_frame, int joint,
                const Twists* xi);

/// What came of closing the loops.
enum class AssemblyStatus {
  kClosed,
  kSingular,     ///< closed, but some passive joint may move by itself there
  kOtherBranch,  ///< closed, but in another way than at the start: a singular posture lies between
  kOpen,         ///< no position of the passive joints closes them; they are where the gap is least
};

/// Closes the loops of one posture after another; one a thread.
class Assembler {
 public:
  explicit Assembler(const Chain& chain);

  /// Moves the passive joints of q (n) from where they are until the loops close.
  bool close(double* q, const Twists* xi);
  /// The same on the way from the posture in which the loops were first closed, Chain::home: in small steps, so that
  /// the way of assembly stays the same.
  AssemblyStatus assemble(double* q);

  /// As the last call has left them.
  const std::vector<Pose>& frames() const { return frames_; }
  const std::vector<LoopRow>& rows() const { return rows_; }
  /// (m, m) d e / d q_passive.
  const Eigen::MatrixXd& by_passive() const { return by_passive_; }
  /// Largest equation [m], [rad], and its place in rows().
  double gap() const;
  int widest() const;

 private:
  void look(const double* q, const Twists* xi);
  bool is_singular() const;
  double determinant() const;
  int side() const;
  /// Derivative of the passive joints on the straight way of the motors, at the last posture.
  Eigen::VectorXd tangent(const std::vector<double>& to, const std::vector<double>& from) const;

  const Chain& chain_;
  std::vector<Pose> frames_;
  std::vector<LoopRow> rows_;
  Eigen::VectorXd e_;
  Eigen::MatrixXd by_passive_;
  int home_side_ = 0;
};

/// What finish() of a robot makes of its loops: equations (loop, component) that determine the passive joints, and the
/// posture `home` in which they close. Throws InvalidInput where they leave a joint free or do not close.
void choose_loop_rows(Chain& chain);

}  // namespace fastcal
