// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What loads do as parameters move. The solver holds loads still inside a solve; its derivative lacks the share by
// which a deflection changes its own load, a per mille of most. Along a direction that deflections alone determine,
// such as opposite offsets of two parallel axes, which only a twisted link sees, that share is as large as what is
// left: the outer iteration creeps, and deviations are wrong. There the derivative is taken from the settled arm, by
// differences.
#pragma once

#include <optional>

#include "fastcal/identification/problem.hpp"

namespace fastcal {

/// The response along the weak directions of J at theta: singular directions that the whitened, scaled J (`factor`, its
/// triangular factor) determines with more than one plausible size of deviation; none where there are none.
std::optional<LoadResponse> load_response(const Problem& problem, const Eigen::VectorXd& theta,
                                          const std::vector<int>& free, const Eigen::VectorXd& scale,
                                          const Eigen::MatrixXd& factor);

/// Of each of the steps (theta's size, k) from theta, what the loads' change adds to the residuals over it, there less
/// back, halved: (N, numbers), for rows in memory.
std::vector<RowMatrixXd> load_changes(const Problem& problem, const Eigen::VectorXd& theta,
                                      const Eigen::MatrixXd& steps);

/// Fills `of_source` of the problem's response, so that no pass over a source finds the changes again.
void keep_changes(const Problem& problem, LoadResponse& response);

}  // namespace fastcal
