// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Eigen's LU with full pivoting of matrices of any size, compiled once, as the decompositions of decompositions.hpp
// are; its solutions are taken by the functions below. Closed loops need it.
#pragma once

#include <Eigen/LU>

extern template class Eigen::FullPivLU<Eigen::MatrixXd>;

namespace fastcal {

/// A^-1 B.
Eigen::MatrixXd solve(const Eigen::FullPivLU<Eigen::MatrixXd>& A, const Eigen::MatrixXd& B);
Eigen::VectorXd solve(const Eigen::FullPivLU<Eigen::MatrixXd>& A, const Eigen::VectorXd& b);

}  // namespace fastcal
