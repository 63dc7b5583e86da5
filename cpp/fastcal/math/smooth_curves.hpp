// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Cubic B-splines over an interval, turned into their smooth basis: curves phi_k with
//   mean phi_j phi_k = delta_jk,   mean phi_j'' phi_k'' = w_k delta_jk,   0 <= w_1 <= w_2 <= ...
// so that "how large" and "how rough" are sums of squares at once, and a penalty on the curvature is a prior of its own
// for each coefficient. The constant (w = 0) is left out; of an interval with ends, phi_1 is the straight line (w = 0
// too). Source: A. Demmler, C. Reinsch, "Oscillation matrices with spline smoothing", Numerische Mathematik 24 (1975).
#pragma once

#include <Eigen/Core>

#include "fastcal/math/types.hpp"

namespace fastcal {

class SmoothCurves {
 public:
  /// `knots` equal pieces between low and high; periodic: the ends are one point.
  SmoothCurves(double low, double high, int knots, bool periodic);

  int count() const { return static_cast<int>(roughness_.size()); }
  /// w_k, the mean square of the second derivative of phi_k [1 / x^4].
  const Eigen::VectorXd& roughness() const { return roughness_; }
  /// phi_k(x) and phi_k'(x), x in [low, high], any x where periodic.
  Eigen::VectorXd values(double x) const { return combine(x, 0); }
  Eigen::VectorXd slopes(double x) const { return combine(x, 1); }

 private:
  Eigen::VectorXd combine(double x, int derivative) const;
  /// The piece that x lies in and the values there of the four B-splines that are not zero on it, or of their first or
  /// second derivative.
  int piece(double x, int derivative, double* spline) const;

  double low_, step_;
  int knots_;
  bool periodic_;
  RowMatrixXd coefficients_;  // (B-splines, curves)
  Eigen::VectorXd roughness_;
};

}  // namespace fastcal
