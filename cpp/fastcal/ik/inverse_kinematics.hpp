// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Joint positions that bring the tool of a model, all effects included, to given poses.
#pragma once

#include <cstdint>
#include <vector>

#include "fastcal/model/error_model.hpp"

namespace fastcal {

enum class IkStatus : int {
  kReached,
  kLimit,        ///< only beyond the limits
  kUnreachable,  ///< not even beyond them: q is the nearest pose found
  kSingular,     ///< reached, in a posture in which the tool can't move in some direction
  kBadTarget,    ///< not a pose, or not finite
};

struct IkOptions {
  RowMatrixXd limits;                ///< (n, 2) [rad, m]; infinite: none
  double reach = 1;                  ///< [m] what lengths are measured by where they meet angles
  double tolerance_position = 1e-9;  ///< [m]
  double tolerance_rotation = 1e-9;  ///< [rad]
  int restarts = 100;                ///< from postures of a quasi-random sequence within the limits
  std::vector<bool> held = {};       ///< (n) joints that stay where the seed has them; empty: none
  bool along_path = false;           ///< every row but the first begins where the one before it ended, without restarts
  std::uint64_t random_seed = 0;
  int threads = 1;

  /// Throws InvalidInput where they do not fit an arm of so many joints.
  void check(int joint_count) const;
};

struct IkResult {
  RowMatrixXd q;                                   ///< (N, n); of a bad target: its seed
  std::vector<int> status;                         ///< (N) IkStatus
  Eigen::VectorXi iterations;                      ///< (N) evaluations of the chain and of the model, restarts included
  Eigen::VectorXd position_error, rotation_error;  ///< (N) distance left [m], angle left [rad]; NaN of a bad target
};

/// Solves T_world_tool(q) = target for every row, targets (N, 16) as 4 x 4 in C order. `samples` holds the conditions
/// of the rows and, as q, the posture that the search begins from. The result does not depend on `threads`.
IkResult inverse_kinematics(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta,
                            const Samples& samples, const Eigen::Ref<const RowMatrixXd>& targets,
                            const IkOptions& options);

/// Motion of the tool, [v; w] in the axes of the measuring frame, by every joint: (N, 6, n), C order. The joints turn
/// about the axes of the deflected arm, whose deflection is held.
void joint_jacobian(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, const Samples& samples,
                    int threads, double* J);

}  // namespace fastcal
