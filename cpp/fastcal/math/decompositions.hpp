// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Eigen's decompositions of matrices of any size, compiled once (decompositions.cpp): in each file that uses them they
// would take longer to compile than all the rest of it. Two rules keep it so. A decomposition is given a MatrixXd, for
// an expression has an instantiation of its own. Its solution and its orthogonal factor are taken by the functions
// below, since Eigen's inline members are compiled wherever they are called.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

extern template class Eigen::HouseholderQR<Eigen::MatrixXd>;
extern template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
extern template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
extern template class Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;
extern template class Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>;
extern template class Eigen::LLT<Eigen::MatrixXd>;
extern template class Eigen::LLT<Eigen::MatrixXd, Eigen::Upper>;
extern template class Eigen::LDLT<Eigen::MatrixXd>;

// Members that are templates of their own.
extern template Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>& Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&, int);
extern template Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>& Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>::compute(
    const Eigen::EigenBase<Eigen::Matrix3d>&, int);
extern template Eigen::LLT<Eigen::MatrixXd>& Eigen::LLT<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);
extern template Eigen::LLT<Eigen::MatrixXd, Eigen::Upper>& Eigen::LLT<Eigen::MatrixXd, Eigen::Upper>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);
extern template Eigen::LDLT<Eigen::MatrixXd>& Eigen::LDLT<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);

namespace fastcal {

/// The first `columns` columns of Q (m, m).
Eigen::MatrixXd q_columns(const Eigen::HouseholderQR<Eigen::MatrixXd>& qr, Eigen::Index columns);
Eigen::MatrixXd q_columns(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr, Eigen::Index columns);

/// H_r ... H_1 X, the first r reflections of Q = H_1 ... H_n; with r the rank, its last m - r rows are what the columns
/// of the matrix leave of X.
Eigen::MatrixXd reflected(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr, Eigen::Index r,
                          const Eigen::MatrixXd& X);

/// A^-1 B, and in the sense of least squares where A (m, n) has more rows than columns.
Eigen::MatrixXd solve(const Eigen::LLT<Eigen::MatrixXd>& A, const Eigen::MatrixXd& B);
Eigen::MatrixXd solve(const Eigen::LDLT<Eigen::MatrixXd>& A, const Eigen::MatrixXd& B);
Eigen::MatrixXd solve(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& A, const Eigen::MatrixXd& B);

/// B A^-1 of a square A, by a factorization with partial pivoting.
Eigen::MatrixXd divided(const Eigen::MatrixXd& B, const Eigen::MatrixXd& A);

/// x of least norm with |A x - b| least, whatever rank A has.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// U^-1 B and L^-1 B of triangular matrices, what lies on the other side of their diagonals not looked at.
Eigen::MatrixXd solve_upper(const Eigen::Ref<const Eigen::MatrixXd>& U, const Eigen::Ref<const Eigen::MatrixXd>& B);
Eigen::MatrixXd solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& L, const Eigen::Ref<const Eigen::MatrixXd>& B);

/// B L^-1 of a lower triangular matrix.
Eigen::MatrixXd divided_by_lower(const Eigen::Ref<const Eigen::MatrixXd>& B,
                                 const Eigen::Ref<const Eigen::MatrixXd>& L);

/// U^-1 of A = U^T U.
Eigen::MatrixXd inverse_root(const Eigen::LLT<Eigen::MatrixXd>& A);

/// The rotation R with the least |R - M|, for M of any rank (W. Kabsch, Acta Crystallographica A 34, 1978).
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);

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
