// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Poses of frames in many rows, and their derivatives by every parameter: chunks of rows side by side (RowBlock),
// loads settled. The results do not depend on `threads`.
#pragma once

#include "fastcal/model/error_model.hpp"

namespace fastcal {

/// Poses T_sensor_target (N, 16), each 4 x 4 in C order.
void predict(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
             const View& view, int threads, double* poses);

/// Derivative of the target's position (rows = 3) or of its motion [v; w] (rows = 6) by every parameter, in the axes
/// of the sensor: (N, rows, P), C order.
void parameter_jacobian(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
                        const View& view, int rows, int threads, double* J);

/// Those of the tool in the measuring frame.
inline void predict(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
                    int threads, double* poses) {
  predict(model, samples, theta, model.robot().view(), threads, poses);
}
inline void parameter_jacobian(const ErrorModel& model, const Samples& samples,
                               const Eigen::Ref<const Eigen::VectorXd>& theta, int rows, int threads, double* J) {
  parameter_jacobian(model, samples, theta, model.robot().view(), rows, threads, J);
}

}  // namespace fastcal
