// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/measurements.hpp"

#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {

void Measurements::check(Eigen::Index rows) const {
  const auto shape = [rows](const auto& table, Eigen::Index cols, const char* name) {
    FASTCAL_CHECK(table.size() == 0 || (table.rows() == rows && table.cols() == cols))
        << name << " must have " << rows << " rows and " << cols << " columns, got " << table.rows() << " and "
        << table.cols();
  };
  shape(position, 3, "position");
  shape(rotation, 4, "rotation");
  shape(distance, 1, "distance");
  shape(anchor, 1, "anchor");
  shape(sigma_position, 3, "sigma_position");
  shape(sigma_rotation, 1, "sigma_rotation");
  FASTCAL_CHECK(position.size() + rotation.size() + distance.size() > 0)
      << "nothing was measured: position, rotation and distance are all missing";
  FASTCAL_CHECK(distance.size() == 0 || anchor.size() == rows) << "distances need an anchor in every row";
  for (Eigen::Index i = 0; i < distance.size(); ++i) {
    FASTCAL_CHECK(std::isnan(distance[i]) || (anchor[i] >= 0 && anchor[i] < anchor_count))
        << "row " << i << ": anchor must be 0 to " << anchor_count - 1 << ", got " << anchor[i];
  }
  FASTCAL_CHECK(!position.array().isInf().any()) << "position must be finite, or NaN where it was not measured";
  for (Eigen::Index i = 0; i < rotation.rows(); ++i) {
    if (rotation.row(i).hasNaN()) continue;
    const double length = rotation.row(i).norm();
    FASTCAL_CHECK(std::abs(length - 1) < 1e-3) << "row " << i << ": a quaternion must have length 1, got " << length;
  }
  FASTCAL_CHECK(!distance.array().isInf().any() && !(distance.array() < 0).any())
      << "distance must be finite and not negative, or NaN where it was not measured";
  FASTCAL_CHECK((sigma_position.array() > 0).all() && sigma_position.allFinite())
      << "sigma_position must be positive and finite";
  FASTCAL_CHECK((sigma_rotation.array() > 0).all() && sigma_rotation.allFinite())
      << "sigma_rotation must be positive and finite";
}

double Measurements::sigma(Eigen::Index i, int component) const {
  switch (kind_of(component)) {
    case Kind::kPosition:
      return sigma_position.size() == 0 ? 0 : sigma_position(i, component);
    case Kind::kRotation:
      return sigma_rotation.size() == 0 ? 0 : sigma_rotation[i];
    default:
      return sigma_position.size() == 0 ? 0 : sigma_position(i, 0);
  }
}

void row_residual(const Measurements& measured, Eigen::Index row, const Pose& T_world_tool,
                  const Eigen::Matrix3Xd* anchors, RowResidual& out) {
  out.present.fill(false);
  out.r.setZero();
  out.J_r_tool.setZero();
  out.anchor = -1;
  if (measured.position.size() > 0) {
    for (int c = 0; c < 3; ++c) {
      const double value = measured.position(row, c);
      if (std::isnan(value)) continue;
      out.present[static_cast<std::size_t>(c)] = true;
      out.r[c] = T_world_tool.p[c] - value;
      out.J_r_tool(c, c) = 1;
    }
  }
  if (measured.rotation.size() > 0 && !measured.rotation.row(row).hasNaN()) {
    const Eigen::Matrix3d R_measured = quaternion_to_rotation(measured.rotation.row(row).transpose());
    const Eigen::Vector3d r = log_so3(R_measured.transpose() * T_world_tool.R);
    out.r.segment<3>(3) = r;
    out.J_r_tool.block<3, 3>(3, 3) = right_jacobian_inverse_so3(r) * T_world_tool.R.transpose();
    out.present[3] = out.present[4] = out.present[5] = true;
  }
  if (measured.distance.size() > 0 && !std::isnan(measured.distance[row])) {
    out.anchor = measured.anchor[row];
    const Eigen::Vector3d line = T_world_tool.p - anchors->col(out.anchor);
    const double length = line.norm();
    out.present[6] = true;
    out.r[6] = length - measured.distance[row];
    const Eigen::Vector3d along = length > 0 ? (line / length).eval() : Eigen::Vector3d::UnitX();
    out.J_r_tool.block<1, 3>(6, 0) = along.transpose();
    out.J_distance_anchor = -along;
  }
}

}  // namespace fastcal
