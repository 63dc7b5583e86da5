// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// Points far from each other: `first` and then, each time, the one that is farthest from all chosen before (T.
/// Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985), the earlier of equals.
///
/// `x` (N, d); `most` of them at most, none nearer than `apart` to another. Indices in the order of the choice. Throws
/// InvalidInput where `first` is no row or `most` is below 1.
std::vector<Eigen::Index> spread_points(const Eigen::Ref<const Eigen::MatrixXd>& x, Eigen::Index first, int most,
                                        double apart);

}  // namespace fastcal
