// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/separation_scan.hpp"

#include <Eigen/Cholesky>
#include <utility>

namespace fastcal::design {

SeparationScan::SeparationScan(const Candidates& candidates, RowMatrixXd u, Eigen::MatrixXd H, int threads)
    : Scan(candidates, threads),
      u_(std::move(u)),
      H_(std::move(H)),
      width_(static_cast<int>(u_.cols())),
      E_(store(Eigen::Index{k_} * width_)) {
  const Eigen::Index p = candidates.columns();
  FASTCAL_CHECK(u_.rows() == candidates.count() * k_ && width_ > 0)
      << "what to separate must have " << candidates.count() * k_ << " rows and a column, got (" << u_.rows() << ", "
      << u_.cols() << ")";
  if (H_.size() == 0) H_ = Eigen::MatrixXd::Zero(p + width_, p + width_);
  FASTCAL_CHECK(H_.rows() == p + width_ && H_.cols() == H_.rows())
      << "earlier information must have " << p + width_ << " rows and columns, got (" << H_.rows() << ", " << H_.cols()
      << ")";
}

std::unique_ptr<Scan> SeparationScan::over(const Candidates& /*candidates*/) const {
  throw InvalidInput("what is to be separated belongs to the candidates it was given with");
}

void SeparationScan::restart_goal(const Eigen::MatrixXd& /*M*/) {
  const Eigen::Index p = covariance_.rows();
  const Eigen::MatrixXd beta = covariance_ * H_.topRightCorner(p, width_);
  value_ = (H_.bottomRightCorner(width_, width_) - H_.bottomLeftCorner(width_, p) * beta).trace();
  candidates_.multiply(beta, threads_, [&](Eigen::Index block, const Lane* X) {
    for (Eigen::Index lane = 0; lane < kLanes; ++lane) {
      const Eigen::Index c = block * kLanes + lane;
      if (c >= candidates_.count()) continue;
      for (int i = 0; i < k_ * width_; ++i) {
        E_[static_cast<std::size_t>((block * k_ * width_ + i) * kLanes + lane)] =
            u_(c * k_ + i / width_, i % width_) - X[i][lane];
      }
    }
  });
}

Eigen::MatrixXd SeparationScan::residual(Eigen::Index candidate) const {
  Eigen::MatrixXd e(k_, width_);
  for (int i = 0; i < k_ * width_; ++i) e(i / width_, i % width_) = lane(E_, Eigen::Index{k_} * width_, candidate, i);
  return e;
}

Eigen::MatrixXd SeparationScan::prepare(Eigen::Index candidate, const Eigen::MatrixXd& U, const Small& L_inverse,
                                        double sign) {
  z_ = L_inverse * residual(candidate);
  value_ += sign * z_.squaredNorm();
  Eigen::MatrixXd none(U.rows(), 0);
  return none;
}

void SeparationScan::change_block(Eigen::Index block, const Lane* X, int columns, double sign) {
  Lane* E = reinterpret_cast<Lane*>(E_.data()) + block * k_ * width_;
  for (int a = 0; a < k_; ++a) {
    for (int n = 0; n < width_; ++n) {
      Lane sum{};
      for (int m = 0; m < k_; ++m) sum += X[a * columns + m] * z_(m, n);
      E[a * width_ + n] -= sign * sum;
    }
  }
}

double SeparationScan::gain(Eigen::Index candidate, const Small& S, double sign) const {
  const Eigen::LLT<Small> root(Small(Small::Identity(k_, k_) + sign * S));
  return sign * root.matrixL().solve(residual(candidate)).squaredNorm();
}

Eigen::VectorXd SeparationScan::sensitivities() const {
  Eigen::VectorXd out(candidates_.count());
  for (Eigen::Index c = 0; c < out.size(); ++c) out[c] = residual(c).squaredNorm();
  return out;
}

}  // namespace fastcal::design
