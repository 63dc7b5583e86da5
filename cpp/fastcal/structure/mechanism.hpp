// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Why a posture of a frame has no solution, in words.
#pragma once

#include <string>

#include "fastcal/structure/beam_frame.hpp"
#include "fastcal/structure/beam_kernel.hpp"

namespace fastcal {

/// One sentence with the posture and what is wrong there: an element without length or without a y axis, a moment
/// on a rotation that nothing holds, or the node and direction that move most when the frame moves without strain:
/// the eigenvector of the smallest eigenvalue of D^-1/2 K D^-1/2, D the diagonal of K.
std::string explain_mechanism(const BeamFrame& frame, const beam::BeamPlan& plan, const beam::BeamBatch& batch,
                              std::ptrdiff_t posture);

}  // namespace fastcal
