// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An effect of one arm of a cell. Frames and joints of a branch follow each other in the tree as they do in the arm
// alone, so the effect, which counts them from 0, is given the branch's part of every row and its twists are put there.
#pragma once

#include <memory>
#include <string>

#include "fastcal/effects/effect.hpp"

namespace fastcal {

/// Columns of Samples::extra and Samples::table that lie before an arm's own: those of the arms before it.
struct ColumnsBefore {
  int extra = 0, table = 0;
};

/// The effect, made for `arm` alone, on the branch of this name; owners become "name.joint3", and conditions are those
/// of the arm. Throws InvalidInput where the tree has no such arm, or for effects of what a cell has not: weights that
/// a calibration changes, beams.
std::shared_ptr<const Effect> on_branch(std::shared_ptr<const Effect> effect, const RobotModel& tree,
                                        const std::string& name, const RobotModel& arm,
                                        const ColumnsBefore& before = {});

}  // namespace fastcal
