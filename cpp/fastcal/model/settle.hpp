// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Brings the state of every row up to date with the model: frames, loads, gear outputs, compliances.
// Loads and deflections depend on each other: load = L(frames(xi)), xi = sum of the effects at that load. Their fixed
// point is the equilibrium of the elastic arm, where its potential energy is least; on arms whose loads change by 1 %
// under their own deflection each round gains two digits.
#pragma once

#include "fastcal/model/error_model.hpp"

namespace fastcal {

/// Fills what model.needs() asks for in `samples`, at parameters theta. Returns the greatest relative change of a load
/// by the last round.
double settle(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, int threads, Samples& samples);

/// The same for given needs (bits of Need): who wants to see loads that no effect asks for.
double settle(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, int threads, Samples& samples,
              unsigned needs);

}  // namespace fastcal
