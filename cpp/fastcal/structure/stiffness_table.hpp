// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An element whose stiffness depends on the posture: K_ij(theta, d) = f_ij(d) g_ij(theta), polynomials fitted to
// sampled matrices (spray-painting paper 2022, eq. 25, unit 9). As there, K is the stiffness of the element's end with
// its start clamped, 3 x 3 or 6 x 6 in local axes; the rest of the element's matrix follows from its equilibrium.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// Matrices of an element's end at S pairs of angle [rad] and extension [m].
struct StiffnessSamples {
  Eigen::VectorXd angle;
  Eigen::VectorXd extension;
  RowMatrixXd matrices;  ///< (S, B * B), each symmetric and positive definite; B = 3 or 6
};

class StiffnessTable {
 public:
  struct Range {
    double low, high;
    double scaled(double value) const { return high > low ? (2 * value - low - high) / (high - low) : 0; }
  };

  /// Least squares over the samples for every entry by itself, by turns in f and g from the best product of the
  /// unconstrained fit. Throws InvalidInput where the samples are too few for the degrees or no stiffness.
  StiffnessTable(const StiffnessSamples& samples, int angle_degree, int extension_degree);

  int size() const { return size_; }
  /// Largest |K_fit - K|_ij / sqrt(K_ii K_jj) over the samples.
  double relative_error() const { return relative_error_; }
  /// What was sampled [rad, m].
  const Range& angle_range() const { return angle_range_; }
  const Range& extension_range() const { return extension_range_; }

  /// Matrices (N, B * B) at N pairs; throws InvalidInput beyond the sampled range by more than 5 % of it.
  RowMatrixXd evaluate(const Eigen::Ref<const Eigen::VectorXd>& angle,
                       const Eigen::Ref<const Eigen::VectorXd>& extension) const;

 private:
  struct Product {
    Eigen::VectorXd f, g;  // coefficients by ascending power of the extension and the angle scaled to -1 .. 1
  };
  /// `tensor` holds the coefficients of the fit without the constraint that it be a product.
  static Product fit_product(const Eigen::MatrixXd& F, const Eigen::MatrixXd& G, const Eigen::VectorXd& k,
                             const Eigen::MatrixXd& tensor);
  static Eigen::MatrixXd powers(const Eigen::Ref<const Eigen::VectorXd>& values, const Range& range, int degree);

  int size_ = 0;
  int angle_degree_ = 0;
  int extension_degree_ = 0;
  Range angle_range_{}, extension_range_{};
  std::vector<Product> products_;  // of the lower triangle, row by row
  double relative_error_ = 0;
};

}  // namespace fastcal
