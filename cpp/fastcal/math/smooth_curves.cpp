// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/smooth_curves.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

// Gauss's points and weights on [0, 1]: exact up to degree 7; the square of a cubic has 6.
constexpr double kPoints[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263};
constexpr double kWeights[4] = {0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692};

/// Columns that span the B-splines' coefficients, apart by symmetry: curves of different symmetry never mix, which
/// keeps pairs of nearly equal roughness apart by more than rounding, so that coefficients in a file mean the same
/// curve on every machine.
std::vector<Eigen::MatrixXd> even_and_odd(Eigen::Index count) {
  std::vector<Eigen::MatrixXd> out;
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Index size = sign > 0 ? (count + 1) / 2 : count / 2;
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(count, size);
    for (Eigen::Index k = 0; k < size; ++k) {
      S(k, k) += 1;
      S(count - 1 - k, k) += sign;
    }
    out.push_back(S);
  }
  return out;
}

/// Of a circle the eigenvectors are known: cosines and sines, k waves around it.
Eigen::MatrixXd waves(Eigen::Index count) {
  Eigen::MatrixXd S(count, count - 1);
  for (Eigen::Index column = 0; column < count - 1; ++column) {
    const Eigen::Index wave = column / 2 + 1;
    const auto k = static_cast<double>(wave);
    for (Eigen::Index j = 0; j < count; ++j) {
      const double angle = 2 * std::numbers::pi * k * static_cast<double>(j) / static_cast<double>(count);
      S(j, column) = column % 2 == 0 ? std::cos(angle) : std::sin(angle);
    }
  }
  return S;
}

}  // namespace

SmoothCurves::SmoothCurves(double low, double high, int knots, bool periodic)
    : low_(low), step_((high - low) / knots), knots_(knots), periodic_(periodic) {
  const Eigen::Index splines = periodic ? knots : knots + 3;
  Eigen::MatrixXd size = Eigen::MatrixXd::Zero(splines, splines);
  Eigen::MatrixXd rough = size;
  for (int p = 0; p < knots; ++p) {
    for (int g = 0; g < 4; ++g) {
      double value[4];
      double bend[4];
      piece(low + (p + kPoints[g]) * step_, 0, value);
      piece(low + (p + kPoints[g]) * step_, 2, bend);
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          size((p + a) % splines, (p + b) % splines) += kWeights[g] * value[a] * value[b] / knots;
          rough((p + a) % splines, (p + b) % splines) += kWeights[g] * bend[a] * bend[b] / knots;
        }
      }
    }
  }
  if (periodic) {
    Eigen::MatrixXd C = waves(splines);
    roughness_.resize(C.cols());
    for (Eigen::Index k = 0; k < C.cols(); ++k) {
      C.col(k) /= std::sqrt(C.col(k).dot(size * C.col(k)));
      roughness_[k] = C.col(k).dot(rough * C.col(k));
    }
    coefficients_ = C;
    return;
  }
  struct Curve {
    double roughness;
    Eigen::VectorXd coefficients;
  };
  std::vector<Curve> curves;
  for (const Eigen::MatrixXd& S : even_and_odd(splines)) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(S.transpose() * rough * S,
                                                                           S.transpose() * size * S);
    for (Eigen::Index k = 0; k < S.cols(); ++k)
      curves.push_back({solver.eigenvalues()[k], S * solver.eigenvectors().col(k)});
  }
  // The even half begins with the constant, the odd one with the straight line, whose roughness is 0 but for rounding.
  curves[static_cast<std::size_t>((splines + 1) / 2)].roughness = 0;
  curves.erase(curves.begin());
  std::stable_sort(curves.begin(), curves.end(),
                   [](const Curve& a, const Curve& b) { return a.roughness < b.roughness; });
  coefficients_.resize(splines, static_cast<Eigen::Index>(curves.size()));
  roughness_.resize(coefficients_.cols());
  for (Eigen::Index k = 0; k < coefficients_.cols(); ++k) {
    const Curve& curve = curves[static_cast<std::size_t>(k)];
    roughness_[k] = curve.roughness;
    coefficients_.col(k) = curve.coefficients;
  }
  const Eigen::VectorXd end = values(high);
  for (Eigen::Index k = 0; k < coefficients_.cols(); ++k) {
    if (end[k] < 0) coefficients_.col(k) *= -1;
  }
}

int SmoothCurves::piece(double x, int derivative, double* spline) const {
  double t = (x - low_) / step_;
  if (periodic_) t -= std::floor(t / knots_) * knots_;
  const int p = std::clamp(static_cast<int>(std::floor(t)), 0, knots_ - 1);
  t -= p;
  const double u = 1 - t;
  if (derivative == 0) {
    spline[0] = u * u * u / 6;
    spline[1] = (4 - 6 * t * t + 3 * t * t * t) / 6;
    spline[2] = (4 - 6 * u * u + 3 * u * u * u) / 6;
    spline[3] = t * t * t / 6;
  } else if (derivative == 1) {
    spline[0] = -u * u / (2 * step_);
    spline[1] = (3 * t * t - 4 * t) / (2 * step_);
    spline[2] = (4 * u - 3 * u * u) / (2 * step_);
    spline[3] = t * t / (2 * step_);
  } else {
    const double squared = step_ * step_;
    spline[0] = u / squared;
    spline[1] = (3 * t - 2) / squared;
    spline[2] = (3 * u - 2) / squared;
    spline[3] = t / squared;
  }
  return p;
}

Eigen::VectorXd SmoothCurves::combine(double x, int derivative) const {
  double spline[4];
  const int p = piece(x, derivative, spline);
  Eigen::VectorXd out = Eigen::VectorXd::Zero(coefficients_.cols());
  for (int a = 0; a < 4; ++a) out += spline[a] * coefficients_.row((p + a) % coefficients_.rows()).transpose();
  return out;
}

}  // namespace fastcal
