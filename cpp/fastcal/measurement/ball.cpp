// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A touch of an unknown ball: the tool's point lies on a sphere, wherever on it.
//   r = |p - c| - R [m]; the centre c (three numbers in the measuring frame) and the radius R of each ball are
//   identified. R is that of the ball and the touching tip together.
// Start: |p|^2 = 2 p . c + (R^2 - |c|^2) is linear in [c, R^2 - |c|^2].
// What a ball leaves open: where the arm is and how it is turned, and the common scale of all lengths.
#include <cmath>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/measurement/one_length.hpp"

namespace fastcal {
namespace {

constexpr int kFewest = 5;
constexpr double kFlat = 1e-6;  // of the largest singular value: touches on one circle fix no sphere

class Ball : public OneLength {
 public:
  Ball(Labels balls, Eigen::VectorXd sigma, int frame)
      : OneLength("ball", "distance", std::move(sigma), frame), balls_(std::move(balls)) {
    for (const std::string& label : balls_.names) {
      for (const char* axis : {"x", "y", "z"})
        parameters_.push_back({"ball " + label, axis, "m", 1e-3, "centre of the ball in the measuring frame"});
      parameters_.push_back({"ball " + label, "radius", "m", 1e-3, "of the ball and the tip that touches it"});
    }
  }

  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (balls_.codes[row] < 0) return;
    out.first_unknown = 4 * balls_.codes[row];
    out.unknown_count = 4;
    const double* own = unknowns + out.first_unknown;
    const Eigen::Vector3d line = sights[0].p - Eigen::Map<const Eigen::Vector3d>(own);
    const double distance = line.norm();
    out.present[0] = true;
    out.r[0] = distance - own[3];
    // A point at the centre has a derivative of length 1 too.
    const Eigen::Vector3d along = distance > 0 ? (line / distance).eval() : Eigen::Vector3d::UnitX();
    out.by_frame[0].topLeftCorner<1, 3>() = along.transpose();
    out.by_unknown.topLeftCorner<1, 3>() = -along.transpose();
    out.by_unknown(0, 3) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t b = 0; b < balls_.names.size(); ++b) {
      std::vector<Eigen::Vector3d> points;
      Eigen::Vector3d center = Eigen::Vector3d::Zero();
      for (Eigen::Index i = 0; i < balls_.codes.size(); ++i) {
        if (balls_.codes[i] != static_cast<int>(b)) continue;
        points.push_back(sights[static_cast<std::size_t>(i)][0].p);
        center += points.back();
      }
      if (points.size() < kFewest) return "each ball needs at least five touches";
      center /= static_cast<double>(points.size());
      Eigen::MatrixXd D(points.size(), 4);
      Eigen::VectorXd y(points.size());
      for (std::size_t k = 0; k < points.size(); ++k) {  // from their mean: else a far ball's square drowns its radius
        const Eigen::Vector3d p = points[k] - center;
        D.row(static_cast<Eigen::Index>(k)) << 2 * p.transpose(), 1;
        y[static_cast<Eigen::Index>(k)] = p.squaredNorm();
      }
      const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(D);
      if (!(std::abs(qr.matrixR()(3, 3)) > kFlat * std::abs(qr.matrixR()(0, 0))))
        return "touches of ball " + balls_.names[b] + " lie on one circle; touch it from above and from all sides";
      const Eigen::VectorXd found = solve(qr, y);
      const Eigen::Vector3d own = found.head<3>();
      unknowns.segment<4>(static_cast<Eigen::Index>(4 * b)) << center + own,
          std::sqrt(std::max(0.0, found[3] + own.squaredNorm()));
    }
    return "";
  }

 private:
  Labels balls_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION("ball",
                             touches<Ball>("ball",
                                           "the points of each label in column 'ball' lie on one unknown sphere"))

}  // namespace fastcal
