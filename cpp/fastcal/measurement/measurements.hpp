// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What was measured, row by row, and how it differs from a predicted pose. NaN: not measured. SI.
#pragma once

#include <array>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// The kinds of coordinate; each has its own unknown noise.
enum class Kind { kPosition = 0, kRotation = 1, kDistance = 2 };
constexpr int kKinds = 3;

/// Components of a row's residual: position x y z [m], rotation vector x y z [rad], distance [m].
constexpr int kComponents = 7;
constexpr Kind kind_of(int component) {
  return component < 3 ? Kind::kPosition : component < 6 ? Kind::kRotation : Kind::kDistance;
}

/// N rows; empty tables were not measured at all.
struct Measurements {
  RowMatrixXd position;      ///< (N, 3) [m], measuring frame
  RowMatrixXd rotation;      ///< (N, 4) unit quaternion w x y z of the tool in the measuring frame
  Eigen::VectorXd distance;  ///< (N) [m] from the row's anchor to the tool
  Eigen::VectorXi anchor;    ///< (N) which anchor, 0 ... anchor_count - 1; -1 where there is no distance
  int anchor_count = 0;
  RowMatrixXd sigma_position;      ///< (N, 3) standard deviation of each coordinate [m]; of a distance its first column
  Eigen::VectorXd sigma_rotation;  ///< (N) [rad]

  /// Throws InvalidInput where a table does not fit `rows` or a standard deviation is not positive.
  void check(Eigen::Index rows) const;

  /// Most numbers that one row can hold.
  Eigen::Index components() const {
    return (position.size() > 0 ? 3 : 0) + (rotation.size() > 0 ? 3 : 0) + (distance.size() > 0 ? 1 : 0);
  }

  /// Claimed standard deviation of component c in row i; 0 where none is claimed.
  double sigma(Eigen::Index i, int component) const;
};

/// A row's residual, predicted minus measured, and its derivative by the tool's motion.
struct RowResidual {
  std::array<bool, kComponents> present{};
  Eigen::Matrix<double, kComponents, 1> r = Eigen::Matrix<double, kComponents, 1>::Zero();
  Eigen::Matrix<double, kComponents, 6> J_r_tool =
      Eigen::Matrix<double, kComponents, 6>::Zero();  ///< by [v; w], axes of the measuring frame
  Eigen::Vector3d J_distance_anchor = Eigen::Vector3d::Zero();
  int anchor = -1;
};

/// position: p - p_measured; rotation: log(R_measured^T R), in tool axes; distance: |p - anchor| - length.
/// `anchors` (3 x anchor_count) may be null where no distance is measured.
void row_residual(const Measurements& measured, Eigen::Index row, const Pose& T_world_tool,
                  const Eigen::Matrix3Xd* anchors, RowResidual& out);

}  // namespace fastcal
