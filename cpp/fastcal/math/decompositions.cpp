// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/decompositions.hpp"

#include <algorithm>
#include <limits>

template class Eigen::HouseholderQR<Eigen::MatrixXd>;
template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
template class Eigen::JacobiSVD<Eigen::MatrixXd>;
template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

namespace fastcal {

RightSvd right_svd(const Eigen::MatrixXd& A) {
  if (!A.allFinite()) {
    const Eigen::Index count = std::min(A.rows(), A.cols());
    return {Eigen::VectorXd::Constant(count, std::numeric_limits<double>::quiet_NaN()),
            Eigen::MatrixXd::Identity(A.cols(), A.cols())};
  }
  // A P = Q R and R^T = W S Z^T give A = (Q Z) S (P W)^T.
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
  const Eigen::Index rank = std::min(A.rows(), A.cols());
  const Eigen::MatrixXd transposed = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>().transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(transposed, Eigen::ComputeFullU);
  return {svd.singularValues(), qr.colsPermutation() * svd.matrixU()};
}

Eigen::MatrixXd inverse_of_lower(const Eigen::MatrixXd& L) {
  const Eigen::Index p = L.rows();
  Eigen::MatrixXd out = Eigen::MatrixXd::Identity(p, p);
  for (Eigen::Index k = 0; k < p; ++k) {
    for (Eigen::Index j = k; j < p; ++j) {
      out(j, k) /= L(j, j);
      const Eigen::Index below = p - 1 - j;
      out.col(k).tail(below) -= out(j, k) * L.col(j).tail(below);
    }
  }
  return out;
}

}  // namespace fastcal
