// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/by_label.hpp"

#include <cmath>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {

ByLabel::ByLabel(std::string name, std::string component, Labels labels, Eigen::VectorXd sigma, int frame)
    : name_(std::move(name)),
      components_{std::move(component)},
      labels_(std::move(labels)),
      sigma_(std::move(sigma)),
      frame_(frame) {}

void ByLabel::add_unknown(const std::string& owner, const std::string& name, const std::string& unit,
                          const std::string& description) {
  const std::size_t each = label_count() == 0 ? 0 : parameters_.size() / label_count() + 1;
  for (std::size_t k = 0; k < label_count(); ++k) {
    const auto at = static_cast<std::ptrdiff_t>(each * (k + 1) - 1);
    parameters_.insert(parameters_.begin() + at, {owner + " " + label(k), name, unit, 1e-3, description});
  }
}

const double* ByLabel::unknowns_of(Eigen::Index row, const double* unknowns, Comparison& out) const {
  if (!is_read(row)) return nullptr;
  out.unknown_count = static_cast<int>(parameters_.size() / label_count());
  out.first_unknown = out.unknown_count * code(row);
  out.present[0] = true;
  return unknowns + out.first_unknown;
}

std::vector<Eigen::Index> ByLabel::rows_of(std::size_t label) const {
  std::vector<Eigen::Index> out;
  for (Eigen::Index i = 0; i < labels_.codes.size(); ++i) {
    if (code(i) == static_cast<int>(label) && is_read(i)) out.push_back(i);
  }
  return out;
}

Places::Places(const std::vector<Sights>& sights, const std::vector<Eigen::Index>& rows)
    : points(3, static_cast<Eigen::Index>(rows.size())), center(Eigen::Vector3d::Zero()) {
  Eigen::Index k = 0;
  for (const Eigen::Index row : rows) points.col(k++) = sights[static_cast<std::size_t>(row)][0].p;
  if (k > 0) center = points.rowwise().mean();
}

Eigen::Vector3d Places::flattest() const {
  const Eigen::Matrix3Xd own = spread();
  const Eigen::Matrix3d sum = own * own.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(0);
}

void compare_along(const double* own, const Eigen::Vector3d& p, Comparison& out) {
  const Eigen::Vector3d turn(own[0], own[1], 0);
  const Eigen::Matrix3d R = exp_so3(turn);
  out.r[0] = R.col(2).dot(p) - own[2];
  out.by_frame[0].topLeftCorner<1, 3>() = R.col(2).transpose();
  // d n = R ((J_r d turn) x e_z)
  const Eigen::Matrix<double, 3, 2> by_turn =
      -R * skew(Eigen::Vector3d::UnitZ()) * right_jacobian_so3(turn).leftCols<2>();
  out.by_unknown.topLeftCorner<1, 2>() = p.transpose() * by_turn;
  out.by_unknown(0, 2) = -1;
}

Eigen::Vector2d turn_from_z(const Eigen::Vector3d& n) {
  const double across = std::hypot(n.x(), n.y());
  const double by = across > 0 ? std::atan2(across, n.z()) / across : 0;
  return {-by * n.y(), by * n.x()};
}

}  // namespace fastcal
