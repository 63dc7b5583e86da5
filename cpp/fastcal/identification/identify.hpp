// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Identification: from a model and its measurements to parameter values, how sure they are, and what the data cannot
// tell. A robust M-estimate with an unknown noise common to all rows (KR500, PMC and SR210D identify by plain least
// squares, loss = none here).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "fastcal/identification/identifiability.hpp"
#include "fastcal/identification/solver.hpp"

namespace fastcal {

enum class Status {
  kConverged,
  kNotConverged,
  kTooFewEquations  ///< fewer independent equations than would fix even one asked parameter
};

struct IdentifyOptions {
  SolverOptions solver;
  LossKind loss = LossKind::kTukey;
  GaugeOptions gauge;
  Limits limits;
  CommonNoise noise;  ///< known, by observation: taken as it is, and deviations are those of it; empty: found
};

struct Identification {
  Status status = Status::kNotConverged;
  std::string message;
  Eigen::VectorXd theta;              ///< the model's parameters, then the observations' unknowns
  std::vector<Parameter> parameters;  ///< of theta
  std::vector<int> free;              ///< what was identified, ascending
  std::vector<int> held;              ///< asked, but held at nominal by the gauge
  Eigen::MatrixXd covariance;         ///< of the free ones, SI
  Eigen::MatrixXd covariance_root;    ///< L, lower triangular with a positive diagonal: covariance = L L^T
  int rank = 0;                       ///< directions of the asked parameters that change anything that was measured
  std::vector<std::string> unidentifiable;             ///< one sentence a held parameter
  std::vector<std::vector<int>> unidentifiable_parts;  ///< the parameters in it, the held one first
  std::vector<int> asked;  ///< model parameters and unknowns, as in the rows of held_directions
  Eigen::MatrixXd
      held_directions;         ///< (asked, held), SI: how all move with a held one that is off by its plausible size
  CommonNoise tau;             ///< noise common to all rows that was found (standard deviation by observation)
  CommonNoise sigma;           ///< RMS standard deviation by observation of what is used: own and common together
  double variance_factor = 1;  ///< where rows claim more noise than there is: what their variance was multiplied by
  int degrees_of_freedom = 0;  ///< numbers of the rows that are no outliers less what the parameters use up
  LossKind loss = LossKind::kNone;  ///< the one that was used: none where too few numbers show any outlier
  std::vector<int> outliers;        ///< rows that the noise does not explain
  int iterations = 0;
  RowMatrixXd residuals;           ///< (N, numbers), NaN where not measured; of the rows in memory
  std::vector<RowWeight> weights;  ///< robust weight of each row at the solution; of the rows in memory
};

/// Identifies the parameters `asked` (indices into the model's parameters) and all unknowns of the observations,
/// starting from the model's own values, whose base and tool should come from align(), as should `unknowns`.
Identification identify(const Problem& problem, const std::vector<int>& asked, const Eigen::VectorXd& unknowns,
                        const IdentifyOptions& options);

}  // namespace fastcal
