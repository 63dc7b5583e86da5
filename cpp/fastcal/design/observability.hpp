// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Observability indices of a design of n poses whose stacked Jacobian has the singular values s_1 >= ... >= s_p,
// columns whitened and scaled (definitions: Y. Sun, J. Hollerbach, "Observability index selection for robot
// calibration", ICRA 2008, table I; O1 by J. Borm and C. Menq 1991, O2 by M. Driels and U. Pathre 1990, O3 and O4 by A.
// Nahvi and J. Hollerbach 1994 and 1996):
//   O1 = (s_1 ... s_p)^(1/p) / sqrt(n),  O2 = s_p / s_1,  O3 = s_p,  O4 = s_p^2 / s_1,  O5 = 1 / (1/s_1 + ... + 1/s_p).
#pragma once

#include "fastcal/design/search.hpp"

namespace fastcal::design {

enum class ObservabilityIndex { kO1 = 1, kO2, kO3, kO4, kO5 };

/// The index of an information matrix J^T J whose eigenvalues (p), ascending, are given; below 0 counts as 0.
double observability(ObservabilityIndex index, const Eigen::VectorXd& eigenvalues, Eigen::Index poses);

/// Improves a design in an index that no rank-k change keeps up to date. Members are exchanged for those of the
/// candidates whose first-order gain is largest, judged exactly by the eigenvalues they lead to. `start` is known
/// before; `members` is where the search begins. Choice::bound is not given (infinite).
Choice improve_observability(ObservabilityIndex index, const Candidates& candidates, const Eigen::MatrixXd& start,
                             std::vector<Eigen::Index> members, int threads, const SearchOptions& options);

}  // namespace fastcal::design
