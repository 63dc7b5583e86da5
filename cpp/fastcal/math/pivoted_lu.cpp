// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/pivoted_lu.hpp"

using Eigen::MatrixXd;

template class Eigen::FullPivLU<MatrixXd>;

namespace fastcal {

MatrixXd solve(const Eigen::FullPivLU<MatrixXd>& A, const MatrixXd& B) { return A.solve(B); }

Eigen::VectorXd solve(const Eigen::FullPivLU<MatrixXd>& A, const Eigen::VectorXd& b) { return A.solve(b); }

}  // namespace fastcal
