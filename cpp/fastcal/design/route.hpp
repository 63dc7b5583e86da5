// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// In which order to visit postures: a short open path, from the nearest neighbour to the nearest, shortened by 2-opt
// (G. Croes, "A method for solving traveling-salesman problems", Operations Research 6, 1958). The way between two
// postures is as long as the joint with the longest way takes: max_j |q_j - q'_j|, joints scaled so that each needs the
// same time for 1.
#pragma once

#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal::design {

/// Order (N) of the rows of `q` (N, n, scaled) that begins at the row nearest to `from` (n).
std::vector<Eigen::Index> visiting_order(const Eigen::Ref<const RowMatrixXd>& q,
                                         const Eigen::Ref<const Eigen::VectorXd>& from);

/// Sum of the ways of an order, the one from `from` to its first row included.
double path_length(const Eigen::Ref<const RowMatrixXd>& q, const Eigen::Ref<const Eigen::VectorXd>& from,
                   const std::vector<Eigen::Index>& order);

}  // namespace fastcal::design
