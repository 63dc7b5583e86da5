// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A touch of an unknown ball: the tool's point lies on a sphere, wherever on it.
//   r = |p - c| - R [m]; the centre c (three numbers in the measuring frame) and the radius R of each ball are
//   identified. R is that of the ball and the touching tip together.
// Start: |p|^2 = 2 p . c + (R^2 - |c|^2) is linear in [c, R^2 - |c|^2].
// What a ball leaves open: where the arm is and how it is turned, and the common scale of all lengths.
#include <algorithm>
#include <cmath>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/measurement/by_label.hpp"

namespace fastcal {
namespace {

constexpr int kFewest = 5;
constexpr double kFlat = 1e-6;  // of the largest singular value: touches on one circle fix no sphere

class Ball : public ByLabel {
 public:
  Ball(Labels balls, Eigen::VectorXd sigma, int frame)
      : ByLabel("ball", "distance", std::move(balls), std::move(sigma), frame) {
    for (const char* axis : {"x", "y", "z"})
      add_unknown("ball", axis, "m", "centre of the ball in the measuring frame");
    add_unknown("ball", "radius", "m", "of the ball and the tip that touches it");
  }

  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    const double* own = unknowns_of(row, unknowns, out);
    if (own == nullptr) return;
    const Eigen::Vector3d line = sights[0].p - Eigen::Map<const Eigen::Vector3d>(own);
    const double distance = line.norm();
    out.r[0] = distance - own[3];
    // A point at the centre has a derivative of length 1 too.
    const Eigen::Vector3d along = distance > 0 ? (line / distance).eval() : Eigen::Vector3d::UnitX();
    out.by_frame[0].topLeftCorner<1, 3>() = along.transpose();
    out.by_unknown.topLeftCorner<1, 3>() = -along.transpose();
    out.by_unknown(0, 3) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t b = 0; b < label_count(); ++b) {
      const Places touched(sights, rows_of(b));
      if (touched.points.cols() < kFewest) return "each ball needs at least five touches";
      const Eigen::Matrix3Xd p = touched.spread();  // else a far ball's square drowns its radius
      Eigen::MatrixXd D(p.cols(), 4);
      D << 2 * p.transpose(), Eigen::VectorXd::Ones(p.cols());
      const Eigen::VectorXd y = p.colwise().squaredNorm().transpose();
      const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(D);
      if (!(std::abs(qr.matrixR()(3, 3)) > kFlat * std::abs(qr.matrixR()(0, 0))))
        return "touches of ball " + label(b) + " lie on one circle; touch it from above and from all sides";
      const Eigen::VectorXd found = solve(qr, y);
      const Eigen::Vector3d own = found.head<3>();
      unknowns.segment<4>(static_cast<Eigen::Index>(4 * b)) << touched.center + own,
          std::sqrt(std::max(0.0, found[3] + own.squaredNorm()));
    }
    return "";
  }
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION("ball",
                             touches<Ball>("ball", "touches of a ball",
                                           "the points of each label in column 'ball' lie on one unknown sphere"))

}  // namespace fastcal
