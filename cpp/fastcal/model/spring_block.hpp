// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The equilibrium of a RowBlock's rows where springs and weights alone decide.
#pragma once

#include <vector>

#include "fastcal/kernels/spring_rows.hpp"
#include "fastcal/math/aligned_numbers.hpp"
#include "fastcal/model/error_model.hpp"

namespace fastcal {

class SpringBlock {
 public:
  /// `frames`: those of the block, which outlive this.
  SpringBlock(const RobotDescription& robot, const Chain& chain, const JointSprings& springs,
              const kernels::FrameRows* frames);

  /// Turns the joints of `rows` rows from `begin` on. By frame: does an effect turn it about its z, does it tilt it,
  /// its angle, shift, sine and cosine (4, stride). False where that finds no equilibrium of every row.
  bool settle(const Samples& samples, Eigen::Index begin, int rows, int stride, const std::vector<bool>& moved,
              const std::vector<bool>& tilted, std::vector<AlignedNumbers>& place);

 private:
  void set_links(const Chain& chain);
  void hang_bodies();
  void skip_upright_joints();

  kernels::Springs springs_, linked_;                         // for any rows; where links are the same in all
  std::vector<kernels::SpringJoint> joints_, linked_joints_;  // of both
  std::vector<kernels::SpringLink> links_;
  int upright_ = 0;      // joints ahead of those of linked_
  double payload_mass_;  // beyond that of the rows that carry one [kg]
  AlignedNumbers payload_;
};

}  // namespace fastcal
