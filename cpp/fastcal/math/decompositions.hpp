// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#pragma once

// Eigen's decompositions, compiled once (decompositions.cpp): in each file that uses them they would take longer to
// compile than all the rest of it.

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

extern template class Eigen::HouseholderQR<Eigen::MatrixXd>;
extern template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
extern template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

namespace fastcal {

/// A = U diag(values) V^T, U left out.
struct RightSvd {
  Eigen::VectorXd values;  ///< (min(rows, cols)), the largest first
  Eigen::MatrixXd V;       ///< (cols, cols), orthogonal
};

/// Two-sided Jacobi on the transposed factor of a pivoted QR, which converges in a few sweeps (Drmac and Veselic, SIAM
/// J. Matrix Anal. Appl. 29, 2008). Not Eigen 3.4's BDCSVD: on a triangular factor with a null space it reads past the
/// end of an array and returns NaN with Success. Where A is not finite, values are NaN.
RightSvd right_svd(const Eigen::MatrixXd& A);

/// Of a lower triangular matrix, what lies above its diagonal not looked at.
Eigen::MatrixXd inverse_of_lower(const Eigen::MatrixXd& L);

}  // namespace fastcal
