// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A touch of an unknown plane: the tool's point lies on it, whatever its place there.
//   r = n . p - d [m], n = exp([rx, ry, 0]) e_z, the normal with n_z >= 0 at the start; p in the measuring frame.
// rx, ry, d of each plane are identified. Start: the direction in which the points of the arm as it is spread least.
// What one plane leaves open: where on it the arm is and how it is turned about its normal, and the common scale of all
// lengths.
#include "fastcal/measurement/by_label.hpp"

namespace fastcal {
namespace {

class Plane : public ByLabel {
 public:
  Plane(Labels planes, Eigen::VectorXd sigma, int frame)
      : ByLabel("plane", "height", std::move(planes), std::move(sigma), frame) {
    for (const char* axis : {"rx", "ry"})
      add_unknown("plane", axis, "rad", "turn of the plane's normal from z of the measuring frame");
    add_unknown("plane", "offset", "m", "of the plane along its normal");
  }

  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (const double* own = unknowns_of(row, unknowns, out)) compare_along(own, sights[0].p, out);
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t a = 0; a < label_count(); ++a) {
      const Places touched(sights, rows_of(a));
      if (touched.points.cols() < 4) return "each plane needs at least four touches";
      Eigen::Vector3d normal = touched.flattest();
      if (normal.z() < 0) normal = -normal;
      unknowns.segment<3>(static_cast<Eigen::Index>(3 * a)) << turn_from_z(normal), normal.dot(touched.center);
    }
    return "";
  }
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION("plane",
                             touches<Plane>("plane", "touches of a plane",
                                            "the points of each label in column 'plane' lie on one unknown plane"))

}  // namespace fastcal
