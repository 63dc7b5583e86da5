// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// How a camera draws a point: from its place in the camera's frame (z forward, x right, y down) [m] to the picture
// [px], pixel (0, 0) being the centre of the first one. With x = X / Z, y = Y / Z, s = x^2 + y^2 and coefficients in
// OpenCV's order:
//   pinhole (D. Brown 1971): a = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3),
//     x' = a x + 2 p1 x y + p2 (s + 2 x^2),  y' = a y + p1 (s + 2 y^2) + 2 p2 x y;  k1 k2 p1 p2 k3 k4 k5 k6
//   fisheye (J. Kannala, S. Brandt 2006): t = atan2(|(X, Y)|, Z), (x', y') = (X, Y) / |(X, Y)| t (1 + k1 t^2 + k2 t^4 +
//     k3 t^6 + k4 t^8);  k1 k2 k3 k4
//   u = fx x' + cx,  v = fy y' + cy
#pragma once

#include <string>
#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

enum class LensModel { kPinhole, kFisheye };

constexpr int kMostIntrinsics = 12;  ///< fx fy cx cy and at most eight coefficients

/// "pinhole" or "fisheye"; throws InvalidInput for another.
LensModel lens_model(const std::string& name);

/// Names of the numbers of a lens: fx, fy, cx, cy, k1 ...
const std::vector<std::string>& intrinsic_names(LensModel model);

using Intrinsics = Eigen::Matrix<double, kMostIntrinsics, 1>;  ///< those that a lens does not have are 0

/// A point in the picture and its derivatives.
struct Drawn {
  Eigen::Vector2d uv;
  Eigen::Matrix<double, 2, 3> by_point;                    ///< px a metre, axes of the camera
  Eigen::Matrix<double, 2, kMostIntrinsics> by_intrinsic;  ///< px a unit
};

/// Draws a point; one behind a pinhole is drawn as if it were a little before it.
Drawn draw(LensModel model, const Intrinsics& intrinsics, const Eigen::Vector3d& point);

/// Direction (x, y, 1) [camera's frame] in which a pixel looks, by Newton's method; a pixel that no direction is drawn
/// at gives the nearest that was found.
Eigen::Vector3d line_of_sight(LensModel model, const Intrinsics& intrinsics, const Eigen::Vector2d& uv);

}  // namespace fastcal
