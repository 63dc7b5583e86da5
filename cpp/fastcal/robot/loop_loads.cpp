// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Forces in closed loops. Each equation e_r = 0 is held by a force f_r along it, and the passive joints bear nothing:
//   tau_p + sum_r f_r d e_r / d q_p = 0
// (virtual work), tau_p the load about a passive joint of all that hangs beyond it in the open tree. f_r acts with
// f_r d e_r / d [v; w] on the frames that the equation joins, and goes down the tree from there; an equation between
// turns of joints is a torque of these joints alone. A rod's pull is -f_r: it pulls its ends together.
#include <algorithm>

#include "fastcal/math/pivoted_lu.hpp"
#include "fastcal/robot/statics.hpp"

namespace fastcal {
namespace {

void add_forces(const Chain& chain, const Assembler& loops, double* load) {
  const FrameTree& tree = *chain.tree;
  const std::vector<Pose>& T = loops.frames();
  const auto part = [&](int joint) {
    return 6 * tree.frame_of_joint(joint) +
           (chain.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2);
  };
  std::fill_n(load + 6 * chain.frame_count(), 6 * chain.loops.size(), 0.0);
  Eigen::VectorXd tau(static_cast<Eigen::Index>(chain.passive.size()));
  for (std::size_t p = 0; p < chain.passive.size(); ++p)
    tau[static_cast<Eigen::Index>(p)] = load[part(chain.passive[p])];
  if (tau.isZero(0)) return;
  const Eigen::VectorXd force = -solve(Eigen::FullPivLU<Eigen::MatrixXd>(loops.by_passive().transpose()), tau);
  for (std::size_t r = 0; r < loops.rows().size(); ++r) {
    const LoopRow& row = loops.rows()[r];
    const double f = force[static_cast<Eigen::Index>(r)];
    if (row.rod >= 0) load[6 * row.rod + kAlongRod] = -f;
    const auto push = [&](int at, const Vector6d& slope) {
      if (at == kWorldFrame) return;
      const Eigen::Vector3d F = f * slope.head<3>();
      const Eigen::Vector3d M = f * slope.tail<3>();
      for (int frame = at; frame != kWorldFrame; frame = tree.parent(frame)) {
        const Pose& here = T[static_cast<std::size_t>(frame)];
        const Eigen::Vector3d arm = T[static_cast<std::size_t>(at)].p - here.p;
        Eigen::Map<Eigen::Vector3d>(load + 6 * frame) += here.R.transpose() * F;
        Eigen::Map<Eigen::Vector3d>(load + 6 * frame + 3) += here.R.transpose() * (M + arm.cross(F));
      }
    };
    push(row.frames.target, row.by_target);
    push(row.frames.sensor, row.by_sensor);
    for (const auto& [joint, share] : row.by_turn) load[part(joint)] += f * share;
  }
}

}  // namespace

void add_loop_loads(const Chain& chain, const Assembler& loops, double* load, double* payload_load) {
  add_forces(chain, loops, load);
  add_forces(chain, loops, payload_load);
}

}  // namespace fastcal
