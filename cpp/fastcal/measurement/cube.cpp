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
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/one_length.hpp"

namespace fastcal {
namespace {

constexpr int kUnknowns = 6;
constexpr int kFewest = 4;  // touches of a face

class Cube : public OneLength {
 public:
  Cube(const Labels& faces, Eigen::VectorXd sigma, int frame) : OneLength("cube", "height", std::move(sigma), frame) {
    std::vector<int> cube_of, face_of;
    for (const std::string& label : faces.names) {
      const std::size_t cut = label.rfind('/');
      const std::string face = cut == std::string::npos ? "" : label.substr(cut + 1);
      FASTCAL_CHECK(face.size() == 1 && face >= "x" && face <= "z" && cut > 0)
          << "column 'cube': expected labels such as block/x, block/y and block/z, got '" << label << "'";
      const std::string name = label.substr(0, cut);
      const auto found = std::find(names_.begin(), names_.end(), name);
      cube_of.push_back(static_cast<int>(found - names_.begin()));
      face_of.push_back(face[0] - 'x');
      if (found == names_.end()) names_.push_back(name);
    }
    cube_.setConstant(faces.codes.size(), -1);
    face_.setConstant(faces.codes.size(), -1);
    for (Eigen::Index i = 0; i < faces.codes.size(); ++i) {
      if (faces.codes[i] < 0) continue;
      cube_[i] = cube_of[static_cast<std::size_t>(faces.codes[i])];
      face_[i] = face_of[static_cast<std::size_t>(faces.codes[i])];
    }
    for (const std::string& name : names_) {
      for (const char* axis : {"rx", "ry", "rz"})
        parameters_.push_back({"cube " + name, axis, "rad", 1e-3, "turn of the cube in the measuring frame"});
      for (const char* face : {"x", "y", "z"})
        parameters_.push_back({"cube " + name, std::string("offset_") + face, "m", 1e-3, "of a face along its normal"});
    }
  }

  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (cube_[row] < 0) return;
    out.first_unknown = kUnknowns * cube_[row];
    out.unknown_count = kUnknowns;
    const double* own = unknowns + out.first_unknown;
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(own);
    const Eigen::Matrix3d R = exp_so3(turn);
    out.present[0] = true;
    out.r[0] = R.col(face_[row]).dot(sights[0].p) - own[3 + face_[row]];
    out.by_frame[0].topLeftCorner<1, 3>() = R.col(face_[row]).transpose();
    // d (R e) = R ((J_r d turn) x e)
    const Eigen::Matrix3d by_turn = -R * skew(Eigen::Vector3d::Unit(face_[row])) * right_jacobian_so3(turn);
    out.by_unknown.topLeftCorner<1, 3>() = sights[0].p.transpose() * by_turn;
    out.by_unknown(0, 3 + face_[row]) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t c = 0; c < names_.size(); ++c) {
      Eigen::Matrix3d normals, centers;
      for (int face = 0; face < 3; ++face) {
        std::vector<Eigen::Vector3d> points;
        for (Eigen::Index i = 0; i < cube_.size(); ++i) {
          if (cube_[i] == static_cast<int>(c) && face_[i] == face)
            points.push_back(sights[static_cast<std::size_t>(i)][0].p);
        }
        if (points.size() < kFewest) return "each cube needs at least four touches of each of its faces x, y and z";
        Eigen::Vector3d center = Eigen::Vector3d::Zero();
        for (const Eigen::Vector3d& p : points) center += p / static_cast<double>(points.size());
        Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
        for (const Eigen::Vector3d& p : points) spread += (p - center) * (p - center).transpose();
        normals.col(face) = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
        centers.col(face) = center;
      }
      const Eigen::Matrix3d R = least_turn(normals);
      const auto first = static_cast<Eigen::Index>(kUnknowns * c);
      unknowns.segment<3>(first) = log_so3(R);
      for (int face = 0; face < 3; ++face) unknowns[first + 3 + face] = R.col(face).dot(centers.col(face));
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

  std::vector<std::string> names_;
  Eigen::VectorXi cube_, face_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "cube",
    touches<Cube>(
        "cube", "the points of labels NAME/x, NAME/y and NAME/z in column 'cube' lie on three planes at right angles"))

}  // namespace fastcal
