// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Inclination of a link, read by a level or an accelerometer on it whose mounting is unknown.
//   u = R_mount^T R_link^T up,  r = (u_x - sin tilt_x) / cos tilt_x, the same of y [rad]
// r is the error of the angle to first order, without the singular slope that asin has at 90 degrees. tilt_x is the
// angle by which the sensor's x axis rises above the horizontal plane, tilt_y that of its y axis; R_mount = exp([rx,
// ry, rz]) in the axes of the link is identified. `up` is against gravity: a constant where gravity is given in the
// measuring frame, else it turns with the base, which is then the second frame that is looked at. Start: rows x and y
// of R_mount^T by linear least squares where the links' postures turn `up` in space, else by the best rotation of the
// measured on the predicted directions (W. Kabsch 1976).
// Where `up` stays in a plane of the link's axes, with normal a (links behind a vertical and parallel horizontal axes),
// a level mirrored at that plane reads the same: x' = H x, y' = H y, z' = -H z, H = I - 2 a a^T. What the arm's errors
// turn out of the plane decides which of the two it is.
#include <algorithm>
#include <cmath>

#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

constexpr double kLeastCosine = 0.02;  // towards 90 degrees a tilt shows less and less
constexpr double kPlanar = 0.05;       // of the largest singular value: below, `up` stays in a plane of the link

class Inclination : public Observation {
 public:
  Inclination(RowMatrixXd tilt, Eigen::VectorXd sigma, const RobotModel& robot, int joint)
      : tilt_(std::move(tilt)),
        sigma_(std::move(sigma)),
        link_(robot.frame_name(link_frame(joint))),
        frames_{link_frame(joint)},
        up_(-robot.description().gravity.normalized()) {
    if (!robot.description().gravity_in_world) frames_.push_back(kBaseFrame);
    for (const char* axis : {"rx", "ry", "rz"})
      parameters_.push_back({"level on " + link_, axis, "rad", 1e-2, "turn of its mounting in the axes of the link"});
  }

  std::string name() const override { return "tilt of " + link_; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"tilt x", "tilt y"};
    return names;
  }
  std::string unit() const override { return "rad"; }
  std::string field() const override { return "tilt@" + link_; }
  std::vector<int> frames() const override { return frames_; }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double sigma(Eigen::Index row, int) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return frames_.size() == 1; }  // where gravity is given in the measuring frame
  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (tilt_.row(row).array().isNaN().all()) return;
    out.unknown_count = 3;
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(unknowns);
    const Eigen::Matrix3d R_mount = exp_so3(turn);
    const Eigen::Vector3d up = up_in_world(sights);
    const Eigen::Vector3d u = R_mount.transpose() * (sights[0].R.transpose() * up);
    const Eigen::Matrix3d R_sensor = sights[0].R * R_mount;
    // The link turns by w: d u = R_sensor^T (up x w); the base does the opposite; the mount by J_r d turn: u x that.
    const Eigen::Matrix3d by_turn = R_sensor.transpose() * skew(up);
    const Eigen::Matrix3d by_mount = skew(u) * right_jacobian_so3(turn);
    for (int c = 0; c < 2; ++c) {
      if (std::isnan(tilt_(row, c))) continue;
      out.present[c] = true;
      const double slope = 1 / std::max(std::cos(tilt_(row, c)), kLeastCosine);
      out.r[c] = slope * (u[c] - std::sin(tilt_(row, c)));
      out.by_frame[0].row(c).tail<3>() = slope * by_turn.row(c);
      if (frames_.size() > 1) out.by_frame[1].row(c).tail<3>() = -slope * by_turn.row(c);
      out.by_unknown.row(c).head<3>() = slope * by_mount.row(c);
    }
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    std::vector<Eigen::Vector3d> up;  // in the axes of the link
    std::vector<Eigen::Vector2d> sine;
    for (Eigen::Index i = 0; i < tilt_.rows(); ++i) {
      if (tilt_.row(i).hasNaN()) continue;
      up.emplace_back(sights[i][0].R.transpose() * up_in_world(sights[i]));
      sine.emplace_back(std::sin(tilt_(i, 0)), std::sin(tilt_(i, 1)));
    }
    if (up.size() < 2) return "a level on " + link_ + " needs at least two rows with both tilts";
    std::vector<Eigen::Matrix3d> mounts;
    Eigen::MatrixXd D(up.size(), 3);
    Eigen::MatrixXd y(up.size(), 2);
    for (std::size_t k = 0; k < up.size(); ++k) {
      D.row(k) = up[k].transpose();
      y.row(k) = sine[k].transpose();
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(D);
    if (std::abs(qr.matrixR()(2, 2)) > kPlanar * std::abs(qr.matrixR()(0, 0))) {
      Eigen::Matrix3d axes;  // columns: the sensor's x, y, z in the link
      axes.leftCols<2>() = solve(qr, y);
      axes.col(2) = axes.col(0).cross(axes.col(1));
      mounts.push_back(nearest_rotation(axes));
    }
    for (const double side : {1.0, -1.0}) {
      Eigen::Matrix3d mount = Eigen::Matrix3d::Identity();
      for (int round = 0; round < 5; ++round) {
        Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
        for (std::size_t k = 0; k < up.size(); ++k) {
          const double z = std::sqrt(std::max(0.0, 1 - sine[k].squaredNorm()));
          const double sign = round == 0 || mount.col(2).dot(up[k]) * side >= 0 ? side : -side;
          M += up[k] * Eigen::Vector3d(sine[k][0], sine[k][1], sign * z).transpose();
        }
        mount = nearest_rotation(M);
      }
      mounts.push_back(mount);
    }
    const auto misfit = [&](const Eigen::Matrix3d& mount) {
      double sum = 0;
      for (std::size_t k = 0; k < up.size(); ++k)
        sum += ((mount.transpose() * up[k]).head<2>() - sine[k]).squaredNorm();
      return sum;
    };
    const auto best = std::min_element(mounts.begin(), mounts.end(),
                                       [&](const auto& a, const auto& b) { return misfit(a) < misfit(b); });
    unknowns = log_so3(*best);
    return "";
  }

  bool mirror(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (Eigen::Index i = 0; i < tilt_.rows(); ++i) {
      if (tilt_.row(i).array().isNaN().all()) continue;
      const Eigen::Vector3d up = sights[i][0].R.transpose() * up_in_world(sights[i]);
      spread += up * up.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of(spread);
    if (!(of.eigenvalues()[0] < kPlanar * kPlanar * of.eigenvalues()[2])) return false;
    const Eigen::Vector3d a = of.eigenvectors().col(0);
    const Eigen::Matrix3d H = Eigen::Matrix3d::Identity() - 2 * a * a.transpose();
    const Eigen::Vector3d handed(1, 1, -1);
    unknowns = log_so3(H * exp_so3(unknowns) * handed.asDiagonal());
    return true;
  }

 private:
  Eigen::Vector3d up_in_world(const Sights& sights) const { return frames_.size() > 1 ? sights[1].R * up_ : up_; }

  RowMatrixXd tilt_;
  Eigen::VectorXd sigma_;
  std::string link_;
  std::vector<int> frames_;
  Eigen::Vector3d up_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "tilt",
    {.plural = "inclinations",
     .fields = {{"tilt", FieldRole::kMeasured, {"tilt_x", "tilt_y"}, "angle", "mrad", true},
                {"sigma_tilt", FieldRole::kSigma, {"sigma_tilt"}, "angle", "mrad"}},
     .note = "",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       std::vector<std::shared_ptr<const Observation>> out;
       for (int joint = 0; joint < robot.joint_count(); ++joint) {
         const RowMatrixXd* tilt = tables.find("tilt@" + robot.frame_name(link_frame(joint)), 2);
         if (tilt == nullptr) continue;
         const auto measured = [&](Eigen::Index i) { return !tilt->row(i).array().isNaN().all(); };
         const RowMatrixXd* sigma = tables.find_sigma("sigma_tilt", 1, measured);
         out.push_back(std::make_shared<Inclination>(*tilt, sigma == nullptr ? Eigen::VectorXd() : sigma->col(0).eval(),
                                                     robot, joint));
       }
       return out;
     }})

}  // namespace fastcal
