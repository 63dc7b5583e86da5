// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Next to a singular posture (wrist axes almost in line, say) the arm can move along a curve of postures that leaves
// the tool where it is but for a tiny motion u in the direction that is almost lost. A pose that needs that motion lies
// somewhere on the curve, perhaps half a turn away, and a descent creeps there: it may leave the curve by no more than
// the error that it has. So the curve is followed, as continuation methods do (E. Allgower, K. Georg, "Introduction to
// Numerical Continuation Methods", 2003): a step along the last right singular vector v of J, then Newton steps in the
// other five directions, until the error along u, the last left one, changes sign; there false position ends it.
#pragma once

#include "fastcal/ik/pose_search.hpp"

namespace fastcal {

/// The posture on the curve through `q` where the pose is reached, or the best one met: it is followed both ways, to
/// the limits or for a turn. Of use where at least six joints are free and `q` is as near to the pose as the curve is.
SearchPoint walk_singular(const Chain& chain, const FramesAt& frames_at, const Goal& goal, const JointLimits& limits,
                          const JointVector& q);

}  // namespace fastcal
