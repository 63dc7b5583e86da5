// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A touch of an unknown plane: the tool's point lies on it, whatever its place there.
//   r = n . p - d [m], n = exp([rx, ry, 0]) e_z, the normal with n_z >= 0 at the start; p in the measuring frame.
// rx, ry, d of each plane are identified. Start: the direction in which the points of the arm as it is spread least.
// What one plane leaves open: where on it the arm is and how it is turned about its normal, and the common scale of all
// lengths.
#include <cmath>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/one_length.hpp"

namespace fastcal {
namespace {

class Plane : public OneLength {
 public:
  Plane(Labels planes, Eigen::VectorXd sigma, int frame)
      : OneLength("plane", "height", std::move(sigma), frame), planes_(std::move(planes)) {
    for (const std::string& label : planes_.names) {
      const std::string owner = "plane " + label;
      for (const char* axis : {"rx", "ry"})
        parameters_.push_back({owner, axis, "rad", 1e-3, "turn of the plane's normal from z of the measuring frame"});
      parameters_.push_back({owner, "offset", "m", 1e-3, "of the plane along its normal"});
    }
  }

  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (planes_.codes[row] < 0) return;
    out.first_unknown = 3 * planes_.codes[row];
    out.unknown_count = 3;
    const double* own = unknowns + out.first_unknown;
    const Eigen::Vector3d turn(own[0], own[1], 0);
    const Eigen::Matrix3d R = exp_so3(turn);
    const Eigen::Vector3d normal = R.col(2);
    out.present[0] = true;
    out.r[0] = normal.dot(sights[0].p) - own[2];
    out.by_frame[0].topLeftCorner<1, 3>() = normal.transpose();
    // d n = R ((J_r d turn) x e_z)
    const Eigen::Matrix<double, 3, 2> by_turn =
        -R * skew(Eigen::Vector3d::UnitZ()) * right_jacobian_so3(turn).leftCols<2>();
    out.by_unknown.topLeftCorner<1, 2>() = sights[0].p.transpose() * by_turn;
    out.by_unknown(0, 2) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t a = 0; a < planes_.names.size(); ++a) {
      Eigen::Vector3d center = Eigen::Vector3d::Zero();
      double count = 0;
      for (Eigen::Index i = 0; i < planes_.codes.size(); ++i) {
        if (planes_.codes[i] != static_cast<int>(a)) continue;
        center += sights[i][0].p;
        ++count;
      }
      if (count < 4) return "each plane needs at least four touches";
      center /= count;
      Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
      for (Eigen::Index i = 0; i < planes_.codes.size(); ++i) {
        if (planes_.codes[i] != static_cast<int>(a)) continue;
        const Eigen::Vector3d p = sights[i][0].p - center;
        spread += p * p.transpose();
      }
      Eigen::Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
      if (normal.z() < 0) normal = -normal;
      unknowns.segment<3>(3 * a) << turn_from_z(normal), normal.dot(center);
    }
    return "";
  }

 private:
  Labels planes_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION("plane",
                             touches<Plane>("plane",
                                            "the points of each label in column 'plane' lie on one unknown plane"))

}  // namespace fastcal
