// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Poses of the tool in many rows, and their derivatives by every parameter: chunks of rows side by side (RowBlock),
// loads settled. The results do not depend on `threads`.
#pragma once

#include "fastcal/model/error_model.hpp"

namespace fastcal {

/// Poses (N, 16), each 4 x 4 in C order, of the tool in the measuring frame.
void predict(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
             int threads, double* poses);

/// Derivative of the tool's position (rows = 3) or of its motion [v; w] (rows = 6) by every parameter: (N, rows, P), C
/// order.
void parameter_jacobian(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
                        int rows, int threads, double* J);

}  // namespace fastcal
