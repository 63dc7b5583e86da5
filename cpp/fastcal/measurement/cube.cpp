// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A touch of a cube or block: the tool's point lies on one of three planes that stand at right angles to each other.
//   r = (R e_f) . p - d_f [m], R = exp([rx, ry, rz]) the block's axes in the measuring frame, e_f its axis x, y or z,
//   d_f the offset of that face. rx, ry, rz and the three offsets of each block are identified: the right angles are
//   what three planes of their own would not know.
// Labels are BLOCK/FACE: "block/x", "block/y", "block/z".
// Start: of each face the direction in which its points spread least; R is the rotation nearest to the three, each of
// the signs with which it turns least. Leaves open what planes do: where the arm is, and the scale of all lengths.
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/by_label.hpp"

namespace fastcal {
namespace {

constexpr std::size_t kFewest = 4;  // touches of a face

/// A label BLOCK/FACE.
struct Face {
  std::string cube;
  int axis;

  explicit Face(const std::string& label) {
    const std::size_t cut = label.rfind('/');
    const std::string face = cut == std::string::npos ? "" : label.substr(cut + 1);
    FASTCAL_CHECK(face.size() == 1 && face >= "x" && face <= "z" && cut > 0)
        << "column 'cube': expected labels such as block/x, block/y and block/z, got '" << label << "'";
    cube = label.substr(0, cut);
    axis = face[0] - 'x';
  }
};

/// The cubes of faces, each once, by the rows' codes.
Labels cubes_of(const Labels& faces) {
  Labels out;
  std::vector<int> cube;
  for (const std::string& label : faces.names) {
    const Face face(label);
    const auto found = std::find(out.names.begin(), out.names.end(), face.cube);
    cube.push_back(static_cast<int>(found - out.names.begin()));
    if (found == out.names.end()) out.names.push_back(face.cube);
  }
  out.codes = faces.codes.unaryExpr([&](int code) { return code < 0 ? -1 : cube[static_cast<std::size_t>(code)]; });
  return out;
}

class Cube : public ByLabel {
 public:
  Cube(const Labels& faces, Eigen::VectorXd sigma, int frame)
      : ByLabel("cube", "height", cubes_of(faces), std::move(sigma), frame), axis_(faces.codes.unaryExpr([&](int code) {
          return code < 0 ? -1 : Face(faces.names[static_cast<std::size_t>(code)]).axis;
        })) {
    for (const char* axis : {"rx", "ry", "rz"})
      add_unknown("cube", axis, "rad", "turn of the cube in the measuring frame");
    for (const char* face : {"offset_x", "offset_y", "offset_z"})
      add_unknown("cube", face, "m", "of a face along its normal");
  }

  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    const double* own = unknowns_of(row, unknowns, out);
    if (own == nullptr) return;
    const int axis = axis_[row];
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(own);
    const Eigen::Matrix3d R = exp_so3(turn);
    out.r[0] = R.col(axis).dot(sights[0].p) - own[3 + axis];
    out.by_frame[0].topLeftCorner<1, 3>() = R.col(axis).transpose();
    // d (R e) = R ((J_r d turn) x e)
    const Eigen::Matrix3d by_turn = -R * skew(Eigen::Vector3d::Unit(axis)) * right_jacobian_so3(turn);
    out.by_unknown.topLeftCorner<1, 3>() = sights[0].p.transpose() * by_turn;
    out.by_unknown(0, 3 + axis) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t c = 0; c < label_count(); ++c) {
      Eigen::Matrix3d normals, centers;
      for (int axis = 0; axis < 3; ++axis) {
        std::vector<Eigen::Index> rows;
        for (const Eigen::Index row : rows_of(c)) {
          if (axis_[row] == axis) rows.push_back(row);
        }
        if (rows.size() < kFewest) return "each cube needs at least four touches of each of its faces x, y and z";
        const Places touched(sights, rows);
        normals.col(axis) = touched.flattest();
        centers.col(axis) = touched.center;
      }
      const Eigen::Matrix3d R = least_turn(normals);
      const auto first = static_cast<Eigen::Index>(6 * c);
      unknowns.segment<3>(first) = log_so3(R);
      for (int axis = 0; axis < 3; ++axis) unknowns[first + 3 + axis] = R.col(axis).dot(centers.col(axis));
    }
    return "";
  }

 private:
  /// The rotation nearest to normals whose signs say nothing, of those that the least turn reaches.
  static Eigen::Matrix3d least_turn(Eigen::Matrix3d normals) {
    if (normals.determinant() < 0) normals.col(2) *= -1;
    Eigen::Matrix3d best = normals;
    for (const std::array<int, 2>& both : {std::array<int, 2>{0, 1}, {0, 2}, {1, 2}}) {
      Eigen::Matrix3d turned = normals;
      for (const int column : both) turned.col(column) *= -1;
      if (turned.trace() > best.trace()) best = turned;
    }
    return nearest_rotation(best);
  }

  Eigen::VectorXi axis_;  // of the face that each row touches
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "cube", touches<Cube>(
                "cube", "touches of a cube",
                "the points of labels NAME/x, NAME/y and NAME/z in column 'cube' lie on three planes at right angles"))

}  // namespace fastcal
