// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/scan.hpp"

#include <cmath>

#include "fastcal/math/decompositions.hpp"

namespace fastcal::design {
namespace {

/// tr(T^-1 G), T positive definite.
template <typename Small>
double trace_of_solution(const Small& T, const Small& G) {
  if (T.rows() == 3) return (Eigen::Matrix3d(T).inverse() * Eigen::Matrix3d(G)).trace();
  return T.llt().solve(G).trace();
}

template <typename Small>
double log_determinant(const Small& T) {
  if (T.rows() == 3) return std::log(Eigen::Matrix3d(T).determinant());
  return 2 * Small(Eigen::LLT<Small>(T).matrixL()).diagonal().array().log().sum();
}

/// R with A = R R^T of a positive semidefinite A.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

}  // namespace

Scan::Scan(const Candidates& candidates, int threads)
    : candidates_(candidates), threads_(threads), k_(candidates.rows()), S_(store(Eigen::Index{k_} * k_)) {}

void Scan::restart(const Eigen::MatrixXd& M) {
  FASTCAL_CHECK(M.rows() == candidates_.columns() && M.cols() == M.rows())
      << "the information matrix must have " << candidates_.columns() << " rows and columns, got (" << M.rows() << ", "
      << M.cols() << ")";
  const Eigen::LLT<Eigen::MatrixXd> root(M);
  FASTCAL_CHECK(root.info() == Eigen::Success) << "the information matrix must be positive definite";
  covariance_ = solve(root, Eigen::MatrixXd::Identity(M.rows(), M.cols()));
  log_determinant_ = 2 * Eigen::MatrixXd(root.matrixL()).diagonal().array().log().sum();
  std::fill(S_.begin(), S_.end(), 0.0);
  const Eigen::MatrixXd L_inverse_transposed = inverse_root(root);
  const int p = static_cast<int>(M.cols());
  candidates_.multiply(L_inverse_transposed, threads_, [&](Eigen::Index block, const Lane* X) {
    subtract_product(reinterpret_cast<Lane*>(S_.data()) + block * k_ * k_, X, k_, p, 0, 0, p, -1);
  });
  restart_goal(M);
}

Scan::Small Scan::s_of(Eigen::Index candidate) const {
  Small S(k_, k_);
  for (int i = 0; i < k_ * k_; ++i) S(i / k_, i % k_) = lane(S_, Eigen::Index{k_} * k_, candidate, i);
  return S;
}

void Scan::change(Eigen::Index candidate, double sign) {
  const Eigen::MatrixXd J = candidates_.block(candidate);
  const Eigen::MatrixXd MJ = covariance_ * J.transpose();
  const Eigen::LLT<Small> root(Small(Small::Identity(k_, k_) + sign * J * MJ));
  FASTCAL_CHECK(root.info() == Eigen::Success) << "taking candidate " << candidate << " away leaves nothing behind";
  const Small L_inverse = root.matrixL().solve(Small(Small::Identity(k_, k_)));
  const Eigen::MatrixXd U = MJ * L_inverse.transpose();
  const Eigen::MatrixXd V = prepare(candidate, U, L_inverse, sign);
  Eigen::MatrixXd UV(U.rows(), U.cols() + V.cols());
  UV << U, V;
  covariance_ -= sign * U * U.transpose();
  log_determinant_ -= 2 * L_inverse.diagonal().array().log().sum();  // adds log det(I +- S)
  const int columns = static_cast<int>(UV.cols());
  candidates_.multiply(UV, threads_, [&](Eigen::Index block, const Lane* X) {
    subtract_product(reinterpret_cast<Lane*>(S_.data()) + block * k_ * k_, X, k_, columns, 0, 0, k_, sign);
    change_block(block, X, columns, sign);
  });
}

Eigen::VectorXd Scan::gains() const {
  Eigen::VectorXd out(candidates_.count());
  parallel_chunks(candidates_.count(), threads_, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index c = begin; c < end; ++c) out[c] = gain(c, s_of(c), 1);
  });
  return out;
}

std::unique_ptr<Scan> DeterminantScan::over(const Candidates& candidates) const {
  return std::make_unique<DeterminantScan>(candidates, threads_);
}

double DeterminantScan::gain(Eigen::Index /*candidate*/, const Small& S, double sign) const {
  return log_determinant(Small(Small::Identity(k_, k_) + sign * S));
}

Eigen::VectorXd DeterminantScan::sensitivities() const {
  Eigen::VectorXd out(candidates_.count());
  for (Eigen::Index c = 0; c < out.size(); ++c) out[c] = s_of(c).trace();
  return out;
}

VarianceScan::VarianceScan(const Candidates& candidates, const Eigen::MatrixXd& B, int threads)
    : Scan(candidates, threads), B_(B), root_(root_of(B)), G_(store(Eigen::Index{k_} * k_)) {
  FASTCAL_CHECK(B.rows() == candidates.columns() && B.cols() == B.rows())
      << "the targets must have " << candidates.columns() << " parameters, got " << B.rows();
}

std::unique_ptr<Scan> VarianceScan::over(const Candidates& candidates) const {
  return std::make_unique<VarianceScan>(candidates, B_, threads_);
}

void VarianceScan::restart_goal(const Eigen::MatrixXd& /*M*/) {
  std::fill(G_.begin(), G_.end(), 0.0);
  const int p = static_cast<int>(root_.cols());
  candidates_.multiply(covariance_ * root_, threads_, [&](Eigen::Index block, const Lane* X) {
    subtract_product(reinterpret_cast<Lane*>(G_.data()) + block * k_ * k_, X, k_, p, 0, 0, p, -1);
  });
}

Eigen::MatrixXd VarianceScan::prepare(Eigen::Index /*candidate*/, const Eigen::MatrixXd& U, const Small& /*L_inverse*/,
                                      double sign) {
  const Eigen::MatrixXd BU = B_ * U;
  return covariance_ * BU - 0.5 * sign * U * (U.transpose() * BU);
}

void VarianceScan::change_block(Eigen::Index block, const Lane* X, int columns, double sign) {
  Lane* G = reinterpret_cast<Lane*>(G_.data()) + block * k_ * k_;
  subtract_product(G, X, k_, columns, 0, k_, k_, sign);
  subtract_product(G, X, k_, columns, k_, 0, k_, sign);
}

double VarianceScan::gain(Eigen::Index candidate, const Small& S, double sign) const {
  Small G(k_, k_);
  for (int i = 0; i < k_ * k_; ++i) G(i / k_, i % k_) = lane(G_, Eigen::Index{k_} * k_, candidate, i);
  return sign * trace_of_solution(Small(Small::Identity(k_, k_) + sign * S), G);
}

Eigen::VectorXd VarianceScan::sensitivities() const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(candidates_.count());
  for (Eigen::Index c = 0; c < out.size(); ++c) {
    for (int i = 0; i < k_; ++i) out[c] += lane(G_, Eigen::Index{k_} * k_, c, Eigen::Index{i} * k_ + i);
  }
  return out;
}

}  // namespace fastcal::design
