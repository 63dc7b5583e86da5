// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/decompositions.hpp"

#include <algorithm>
#include <limits>

using Eigen::Index;
using Eigen::MatrixXd;

template class Eigen::HouseholderQR<MatrixXd>;
template class Eigen::ColPivHouseholderQR<MatrixXd>;
template class Eigen::CompleteOrthogonalDecomposition<MatrixXd>;
template class Eigen::JacobiSVD<MatrixXd>;
template class Eigen::SelfAdjointEigenSolver<MatrixXd>;
template class Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;
template class Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>;
template class Eigen::LLT<MatrixXd>;
template class Eigen::LLT<MatrixXd, Eigen::Upper>;
template class Eigen::LDLT<MatrixXd>;

template Eigen::SelfAdjointEigenSolver<MatrixXd>& Eigen::SelfAdjointEigenSolver<MatrixXd>::compute(
    const Eigen::EigenBase<MatrixXd>&, int);
template Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>& Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>::compute(
    const Eigen::EigenBase<Eigen::Matrix3d>&, int);
template Eigen::LLT<MatrixXd>& Eigen::LLT<MatrixXd>::compute(const Eigen::EigenBase<MatrixXd>&);
template Eigen::LLT<MatrixXd, Eigen::Upper>& Eigen::LLT<MatrixXd, Eigen::Upper>::compute(
    const Eigen::EigenBase<MatrixXd>&);
template Eigen::LDLT<MatrixXd>& Eigen::LDLT<MatrixXd>::compute(const Eigen::EigenBase<MatrixXd>&);

namespace fastcal {

MatrixXd q_columns(const Eigen::HouseholderQR<MatrixXd>& qr, Index columns) {
  return qr.householderQ() * MatrixXd::Identity(qr.rows(), columns);
}

MatrixXd q_columns(const Eigen::ColPivHouseholderQR<MatrixXd>& qr, Index columns) {
  return qr.householderQ() * MatrixXd::Identity(qr.rows(), columns);
}

MatrixXd reflected(const Eigen::ColPivHouseholderQR<MatrixXd>& qr, Index r, const MatrixXd& X) {
  return qr.householderQ().setLength(r).transpose() * X;
}

MatrixXd solve(const Eigen::LLT<MatrixXd>& A, const MatrixXd& B) { return A.solve(B); }

MatrixXd solve(const Eigen::LDLT<MatrixXd>& A, const MatrixXd& B) { return A.solve(B); }

MatrixXd solve(const Eigen::ColPivHouseholderQR<MatrixXd>& A, const MatrixXd& B) { return A.solve(B); }

MatrixXd divided(const MatrixXd& B, const MatrixXd& A) {
  return A.transpose().partialPivLu().solve(B.transpose()).transpose();
}

Eigen::VectorXd least_squares(const MatrixXd& A, const Eigen::VectorXd& b) {
  return A.completeOrthogonalDecomposition().solve(b);
}

MatrixXd solve_upper(const Eigen::Ref<const MatrixXd>& U, const Eigen::Ref<const MatrixXd>& B) {
  return U.triangularView<Eigen::Upper>().solve(B);
}

MatrixXd solve_lower(const Eigen::Ref<const MatrixXd>& L, const Eigen::Ref<const MatrixXd>& B) {
  return L.triangularView<Eigen::Lower>().solve(B);
}

MatrixXd divided_by_lower(const Eigen::Ref<const MatrixXd>& B, const Eigen::Ref<const MatrixXd>& L) {
  return L.transpose().triangularView<Eigen::Upper>().solve(B.transpose()).transpose();
}

MatrixXd inverse_root(const Eigen::LLT<MatrixXd>& A) {
  return A.matrixU().solve(MatrixXd::Identity(A.rows(), A.cols()));
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d& U = svd.matrixU();
  const Eigen::Matrix3d& V = svd.matrixV();
  const Eigen::Vector3d sign(1, 1, (U * V.transpose()).determinant() < 0 ? -1 : 1);
  return U * sign.asDiagonal() * V.transpose();
}

RightSvd right_svd(const MatrixXd& A) {
  if (!A.allFinite()) {
    const Index count = std::min(A.rows(), A.cols());
    return {Eigen::VectorXd::Constant(count, std::numeric_limits<double>::quiet_NaN()),
            MatrixXd::Identity(A.cols(), A.cols())};
  }
  // A P = Q R and R^T = W S Z^T give A = (Q Z) S (P W)^T.
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  const Index rank = std::min(A.rows(), A.cols());
  const MatrixXd transposed = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>().transpose();
  const Eigen::JacobiSVD<MatrixXd> svd(transposed, Eigen::ComputeFullU);
  return {svd.singularValues(), qr.colsPermutation() * svd.matrixU()};
}

MatrixXd inverse_of_lower(const MatrixXd& L) {
  const Index p = L.rows();
  MatrixXd out = MatrixXd::Identity(p, p);
  for (Index k = 0; k < p; ++k) {
    for (Index j = k; j < p; ++j) {
      out(j, k) /= L(j, j);
      const Index below = p - 1 - j;
      out.col(k).tail(below) -= out(j, k) * L.col(j).tail(below);
    }
  }
  return out;
}

}  // namespace fastcal
