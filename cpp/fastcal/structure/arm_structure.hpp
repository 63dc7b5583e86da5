// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The beams of an arm: a space frame whose nodes lie in frames of the chain, loaded by the weight of its elements, of
// masses on its nodes, of the links and the payload that its nodes carry. Joints are held: a drive's own compliance is
// another effect.
// Node k with displacement u_k and rotation phi_k moves the frame that it is tied to, whose origin is p_f; what the
// frame tied before has moved already is not counted twice:
//   U_k = u_k + phi_k x (p_f - p_k),  xi_f = R_f^T [U_k - U_(k-1) - phi_(k-1) x (p_f - p_f'); phi_k - phi_(k-1)].
// Small displacements on the posture of the state, which settle() brings to equilibrium.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fastcal/robot/arm_bending.hpp"
#include "fastcal/structure/beam_solver.hpp"
#include "fastcal/structure/stiffness_table.hpp"

namespace fastcal {

struct StructureNode {
  std::string name;
  int origin = 0;                                      ///< the frame from whose origin it is counted
  int frame = 0;                                       ///< in whose axes it is given
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] there
  int moves = -1;                                      ///< the frame that it moves, -1: none
  double mass = 0;                                     ///< [kg]
  std::vector<int> links;                              ///< whose weight it carries, from 0
  bool carries_payload = false;                        ///< payload and wrench act on it
  unsigned held = 0;                                   ///< directions, bits of BeamSupport
};

struct StructureElement {
  std::string name;
  BeamElement beam;
  unsigned start_hinge = 0, end_hinge = 0;        ///< axes, bits of BeamHinge
  int group = 0;                                  ///< whose compliance factor is the element's
  int up_frame = 0;                               ///< of the chain, in whose axes `up` is given
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< a direction in its local x-z plane, on the side of +z
  Matrix6d stiffness = Matrix6d::Zero();          ///< of a sampled element without a table: its end, start clamped
  int table = -1;                                 ///< of the sampled element, -1: none
};

/// Sampled stiffness over the positions of two joints (from 0; -1: it does not depend on one).
struct StructureTable {
  StiffnessTable table;
  int angle_joint = -1, extension_joint = -1;
};

struct StructureDescription {
  std::vector<StructureNode> nodes;
  std::vector<StructureElement> elements;
  std::vector<StructureTable> tables;
  std::vector<std::string> groups;
};

class ArmStructure : public ArmBending {
 public:
  /// Throws InvalidInput where the frame is invalid, or two nodes move one frame.
  explicit ArmStructure(StructureDescription description);

  const std::vector<std::string>& groups() const override { return description_.groups; }
  const std::vector<int>& frames() const override { return frames_; }
  void basis(const RobotDescription& robot, const State& state, const double* scale, double* B) const override;

  /// Positions of the nodes (M, 3) [m] in the measuring frame.
  RowMatrixXd positions(const State& state) const;

  /// Forces and moments on the nodes (M, 6) [N, N m] in the axes of the measuring frame, beside the elements' weight.
  RowMatrixXd loads(const RobotDescription& robot, const State& state, const RowMatrixXd& positions) const;

 private:
  RowMatrixXd up(const State& state) const;
  RowMatrixXd stiffness(const State& state) const;

  StructureDescription description_;
  std::unique_ptr<BeamSolver> solver_;
  std::vector<int> frames_, movers_;  // frames that are moved, ascending, and the nodes that move them
  std::vector<int> group_;            // of each element
};

}  // namespace fastcal
