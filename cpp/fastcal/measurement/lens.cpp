// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/lens.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr double kNearest = 1e-3;  // [m] before the camera
constexpr double kOnAxis = 1e-9;   // sine of the angle to it

/// (x', y') of a point, their derivatives by it and by the coefficients.
struct Bent {
  Eigen::Vector2d xy;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, 8> by_coefficient = Eigen::Matrix<double, 2, 8>::Zero();
};

Bent bend_brown(const double* k, const Eigen::Vector3d& P) {
  Bent out;
  const double Z = std::max(P.z(), kNearest);
  const double x = P.x() / Z, y = P.y() / Z, s = x * x + y * y;
  const double above = 1 + s * (k[0] + s * (k[1] + s * k[4]));
  const double below = 1 + s * (k[5] + s * (k[6] + s * k[7]));
  const double a = above / below;
  const double a_s = (k[0] + s * (2 * k[1] + 3 * s * k[4]) - a * (k[5] + s * (2 * k[6] + 3 * s * k[7]))) / below;
  const double p1 = k[2], p2 = k[3];
  out.xy << a * x + 2 * p1 * x * y + p2 * (s + 2 * x * x), a * y + p1 * (s + 2 * y * y) + 2 * p2 * x * y;
  Eigen::Matrix2d by_xy;
  by_xy << a + 2 * x * x * a_s + 2 * p1 * y + 6 * p2 * x, 2 * x * y * a_s + 2 * p1 * x + 2 * p2 * y,
      2 * x * y * a_s + 2 * p1 * x + 2 * p2 * y, a + 2 * y * y * a_s + 6 * p1 * y + 2 * p2 * x;
  Eigen::Matrix<double, 2, 3> xy_by_point;
  xy_by_point << 1 / Z, 0, -x / Z, 0, 1 / Z, -y / Z;
  if (P.z() <= kNearest) xy_by_point.col(2).setZero();
  out.by_point = by_xy * xy_by_point;
  const Eigen::Vector2d xy(x, y);
  out.by_coefficient.col(0) = xy * s / below;
  out.by_coefficient.col(1) = xy * s * s / below;
  out.by_coefficient.col(2) << 2 * x * y, s + 2 * y * y;
  out.by_coefficient.col(3) << s + 2 * x * x, 2 * x * y;
  out.by_coefficient.col(4) = xy * s * s * s / below;
  for (int n = 0; n < 3; ++n) out.by_coefficient.col(5 + n) = -a * out.by_coefficient.col(n == 2 ? 4 : n);
  return out;
}

Bent bend_fisheye(const double* k, const Eigen::Vector3d& P) {
  Bent out;
  const double rho = P.head<2>().norm(), square = P.squaredNorm();
  if (!(rho > kOnAxis * std::sqrt(square)) && P.z() > 0) {  // there it is a pinhole
    out.xy = P.head<2>() / P.z();
    out.by_point << 1 / P.z(), 0, -P.x() / (P.z() * P.z()), 0, 1 / P.z(), -P.y() / (P.z() * P.z());
    return out;
  }
  const Eigen::Vector2d side = P.head<2>() / std::max(rho, 1e-300);
  const double t = std::atan2(rho, P.z()), t2 = t * t;
  const double bent = t * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  const double bent_t = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
  out.xy = bent * side;
  // d t = (Z d rho - rho d Z) / |P|^2; d side = (1 - side side^T) d(X, Y) / rho
  const Eigen::Matrix2d along = side * side.transpose();
  out.by_point.leftCols<2>() = bent_t * P.z() / square * along + bent / rho * (Eigen::Matrix2d::Identity() - along);
  out.by_point.col(2) = -bent_t * rho / square * side;
  double power = t;
  for (int n = 0; n < 4; ++n) out.by_coefficient.col(n) = (power *= t2) * side;
  return out;
}

}  // namespace

LensModel lens_model(const std::string& name) {
  FASTCAL_CHECK(name == "pinhole" || name == "fisheye") << "a lens is pinhole or fisheye, got '" << name << "'";
  return name == "pinhole" ? LensModel::kPinhole : LensModel::kFisheye;
}

const std::vector<std::string>& intrinsic_names(LensModel model) {
  static const std::vector<std::string> pinhole{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  static const std::vector<std::string> fisheye{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  return model == LensModel::kPinhole ? pinhole : fisheye;
}

Drawn draw(LensModel model, const Intrinsics& intrinsics, const Eigen::Vector3d& point) {
  const double* k = intrinsics.data() + 4;
  const Bent bent = model == LensModel::kPinhole ? bend_brown(k, point) : bend_fisheye(k, point);
  const Eigen::Vector2d focal = intrinsics.head<2>();
  Drawn out;
  out.uv = focal.cwiseProduct(bent.xy) + intrinsics.segment<2>(2);
  out.by_point = focal.asDiagonal() * bent.by_point;
  out.by_intrinsic.leftCols<2>() = bent.xy.asDiagonal();
  out.by_intrinsic.middleCols<2>(2).setIdentity();
  out.by_intrinsic.rightCols<8>() = focal.asDiagonal() * bent.by_coefficient;
  return out;
}

Eigen::Vector3d line_of_sight(LensModel model, const Intrinsics& intrinsics, const Eigen::Vector2d& uv) {
  constexpr int kRounds = 30;
  Eigen::Vector3d line((uv - intrinsics.segment<2>(2)).cwiseQuotient(intrinsics.head<2>()).homogeneous());
  double left = (draw(model, intrinsics, line).uv - uv).norm();
  for (int round = 0; round < kRounds; ++round) {
    const Drawn here = draw(model, intrinsics, line);
    const Eigen::Matrix2d slope = here.by_point.leftCols<2>();
    if (!(std::abs(slope.determinant()) > 1e-12)) break;
    Eigen::Vector2d step = slope.inverse() * (uv - here.uv);
    double now = left;
    Eigen::Vector3d next = line;
    for (int half = 0; half < 10; ++half, step *= 0.5) {  // a lens bends back beyond its picture
      next.head<2>() = line.head<2>() + step;
      now = (draw(model, intrinsics, next).uv - uv).norm();
      if (now < left) break;
    }
    if (!(now < left)) break;
    line = next;
    left = now;
  }
  return line;
}

}  // namespace fastcal
