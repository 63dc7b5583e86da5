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

/// How near to the equilibrium, and from where.
struct SettleOptions {
  unsigned needs = 0;        ///< bits of Need
  double tolerance = 1e-14;  ///< change by a round, of the largest load and of the arm's length
  bool goes_on = false;      ///< `samples` hold what an earlier call filled, for postures nearby
};

/// The same for given needs: who wants to see loads that no effect asks for, or moves the posture while it settles.
double settle(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, int threads, Samples& samples,
              const SettleOptions& options);

}  // namespace fastcal
