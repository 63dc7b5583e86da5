// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/stiffness_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

constexpr int kMostTurns = 500;
constexpr double kBeyond = 0.05;  // of the sampled range: what corrected drives may ask for

void check_enough(const Eigen::VectorXd& values, int degree, const char* name) {
  const std::set<double> distinct(values.begin(), values.end());
  FASTCAL_CHECK(degree >= 0 && distinct.size() > static_cast<std::size_t>(degree))
      << "a polynomial of degree " << degree << " in the " << name << " needs " << degree + 1
      << " different values, got " << distinct.size();
}

void check_samples(const StiffnessSamples& samples, int size) {
  FASTCAL_CHECK(size * size == samples.matrices.cols() && (size == 3 || size == 6))
      << "sampled stiffness must be 3 x 3 (plane) or 6 x 6 (space) matrices";
  FASTCAL_CHECK(samples.angle.size() == samples.matrices.rows() && samples.extension.size() == samples.matrices.rows())
      << "there must be one angle and one extension for each of " << samples.matrices.rows() << " matrices, got "
      << samples.angle.size() << " and " << samples.extension.size();
  FASTCAL_CHECK(samples.angle.allFinite() && samples.extension.allFinite() && samples.matrices.allFinite())
      << "sampled stiffness, angles and extensions must be finite";
  for (Eigen::Index s = 0; s < samples.matrices.rows(); ++s) {
    const Eigen::Map<const RowMatrixXd> K(samples.matrices.row(s).data(), size, size);
    const Eigen::VectorXd scale = K.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * K * scale.asDiagonal();
    FASTCAL_CHECK((scaled - scaled.transpose()).cwiseAbs().maxCoeff() < 1e-6)
        << "the stiffness of sample " << s << " must be symmetric";
    FASTCAL_CHECK(Eigen::LLT<Eigen::MatrixXd>(scaled).info() == Eigen::Success)
        << "the stiffness of sample " << s << " must be positive definite";
  }
}

/// x with diag(weight) basis x nearest to k.
Eigen::VectorXd weighted_fit(const Eigen::VectorXd& weight, const Eigen::MatrixXd& basis, const Eigen::VectorXd& k) {
  return least_squares(weight.asDiagonal() * basis, k);
}

}  // namespace

StiffnessTable::Product StiffnessTable::fit_product(const Eigen::MatrixXd& F, const Eigen::MatrixXd& G,
                                                    const Eigen::VectorXd& k, const Eigen::MatrixXd& tensor) {
  Product product;
  product.g = Eigen::JacobiSVD<Eigen::MatrixXd>(tensor, Eigen::ComputeThinU | Eigen::ComputeThinV).matrixV().col(0);
  product.f = weighted_fit(G * product.g, F, k);
  double before = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const double after = ((F * product.f).cwiseProduct(G * product.g) - k).norm();
    if (!(after < before * (1 - 1e-9))) break;
    before = after;
    product.g = weighted_fit(F * product.f, G, k);
    const double size = product.g.norm();
    if (size > 0) product.g /= size;
    product.f = weighted_fit(G * product.g, F, k);
  }
  return product;
}

Eigen::MatrixXd StiffnessTable::powers(const Eigen::Ref<const Eigen::VectorXd>& values, const Range& range,
                                       int degree) {
  Eigen::MatrixXd V(values.size(), degree + 1);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double x = range.scaled(values[i]);
    V(i, 0) = 1;
    for (int k = 0; k < degree; ++k) V(i, k + 1) = V(i, k) * x;
  }
  return V;
}

StiffnessTable::StiffnessTable(const StiffnessSamples& samples, int angle_degree, int extension_degree)
    : size_(static_cast<int>(std::lround(std::sqrt(static_cast<double>(samples.matrices.cols()))))),
      angle_degree_(angle_degree),
      extension_degree_(extension_degree) {
  FASTCAL_CHECK(samples.matrices.rows() > 0) << "a stiffness table needs samples";
  check_samples(samples, size_);
  check_enough(samples.angle, angle_degree, "angle");
  check_enough(samples.extension, extension_degree, "extension");
  angle_range_ = {samples.angle.minCoeff(), samples.angle.maxCoeff()};
  extension_range_ = {samples.extension.minCoeff(), samples.extension.maxCoeff()};
  const Eigen::MatrixXd G = powers(samples.angle, angle_range_, angle_degree);
  const Eigen::MatrixXd F = powers(samples.extension, extension_range_, extension_degree);
  Eigen::MatrixXd both(F.rows(), F.cols() * G.cols());
  for (Eigen::Index s = 0; s < F.rows(); ++s) {
    for (Eigen::Index j = 0; j < G.cols(); ++j) both.row(s).segment(j * F.cols(), F.cols()) = G(s, j) * F.row(s);
  }
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> unconstrained(both);
  for (int row = 0; row < size_; ++row) {
    for (int column = 0; column <= row; ++column) {
      const Eigen::VectorXd k =
          (samples.matrices.col(row * size_ + column) + samples.matrices.col(column * size_ + row)) / 2;
      const Eigen::VectorXd coefficients = unconstrained.solve(k);
      const Eigen::Map<const Eigen::MatrixXd> tensor(coefficients.data(), F.cols(), G.cols());
      products_.push_back(fit_product(F, G, k, tensor));
    }
  }
  const RowMatrixXd fitted = evaluate(samples.angle, samples.extension);
  for (Eigen::Index s = 0; s < fitted.rows(); ++s) {
    const Eigen::Map<const RowMatrixXd> K(samples.matrices.row(s).data(), size_, size_);
    const Eigen::Map<const RowMatrixXd> K_fit(fitted.row(s).data(), size_, size_);
    const Eigen::VectorXd scale = K.diagonal().cwiseSqrt().cwiseInverse();
    relative_error_ =
        std::max(relative_error_, (scale.asDiagonal() * (K_fit - K) * scale.asDiagonal()).cwiseAbs().maxCoeff());
  }
}

RowMatrixXd StiffnessTable::evaluate(const Eigen::Ref<const Eigen::VectorXd>& angle,
                                     const Eigen::Ref<const Eigen::VectorXd>& extension) const {
  FASTCAL_CHECK(angle.size() == extension.size())
      << "angle and extension must be of one length, got " << angle.size() << " and " << extension.size();
  const auto check_range = [](const Eigen::Ref<const Eigen::VectorXd>& values, const Range& range, const char* name,
                              const char* unit) {
    const double margin = kBeyond * (range.high - range.low);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      FASTCAL_CHECK(values[i] >= range.low - margin && values[i] <= range.high + margin)
          << name << " of posture " << i << " is " << values[i] << " " << unit
          << ", but the stiffness was sampled from " << range.low << " to " << range.high << " " << unit;
    }
  };
  check_range(angle, angle_range_, "angle", "rad");
  check_range(extension, extension_range_, "extension", "m");
  const Eigen::MatrixXd G = powers(angle, angle_range_, angle_degree_);
  const Eigen::MatrixXd F = powers(extension, extension_range_, extension_degree_);
  RowMatrixXd matrices(angle.size(), size_ * size_);
  std::size_t entry = 0;
  for (int row = 0; row < size_; ++row) {
    for (int column = 0; column <= row; ++column) {
      const Product& product = products_[entry++];
      matrices.col(row * size_ + column) = (F * product.f).cwiseProduct(G * product.g);
      matrices.col(column * size_ + row) = matrices.col(row * size_ + column);
    }
  }
  return matrices;
}

}  // namespace fastcal
