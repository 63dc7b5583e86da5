// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An orientation of the tool in the measuring frame, a unit quaternion; or that of any frame, from an instrument that
// stands on another one, R = R_sensor^T R_target.
//   r = log(R_measured^T R) [rad], the turn in the axes of the target.
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

class Orientation : public Observation {
 public:
  Orientation(RowMatrixXd wxyz, Eigen::VectorXd sigma, ViewedTable of)
      : wxyz_(std::move(wxyz)), sigma_(std::move(sigma)), of_(std::move(of)) {
    for (Eigen::Index i = 0; i < wxyz_.rows(); ++i) {
      if (wxyz_.row(i).hasNaN()) continue;
      const double length = wxyz_.row(i).norm();
      FASTCAL_CHECK(std::abs(length - 1) < 1e-3) << "row " << i << ": a quaternion must have length 1, got " << length;
    }
  }

  std::string name() const override { return "orientation" + of_.suffix; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"rx", "ry", "rz"};
    return names;
  }
  std::string unit() const override { return "rad"; }
  std::string field() const override { return "rotation" + of_.suffix; }
  std::vector<int> frames() const override { return frames_of(of_.view); }
  double sigma(Eigen::Index row, int) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return true; }
  bool is_pose() const override { return of_.suffix.empty(); }
  bool shows_tool_turn() const override { return true; }
  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double*, Comparison& out) const override {
    if (wxyz_.row(row).hasNaN()) return;
    const Eigen::Matrix3d R_measured = quaternion_to_rotation(wxyz_.row(row).transpose());
    const bool is_from_sensor = of_.view.sensor != kWorldFrame;
    out.r = is_from_sensor ? log_so3(R_measured.transpose() * (sights[1].R.transpose() * sights[0].R))
                           : log_so3(R_measured.transpose() * sights[0].R);
    out.by_frame[0].rightCols<3>() = right_jacobian_inverse_so3(out.r) * sights[0].R.transpose();
    if (is_from_sensor) out.by_frame[1].rightCols<3>() = -out.by_frame[0].rightCols<3>();
    out.present.fill(true);
  }

  void add_pose(Eigen::Index row, MeasuredPose& pose) const override {
    if (wxyz_.row(row).hasNaN()) return;
    pose.has_rotation = true;
    pose.R_world_tool = quaternion_to_rotation(wxyz_.row(row).transpose());
  }

 private:
  RowMatrixXd wxyz_;
  Eigen::VectorXd sigma_;
  ViewedTable of_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION("orientation",
                             {.plural = "orientations",
                              .fields = {{"rotation", FieldRole::kMeasured, {"qw", "qx", "qy", "qz"}, "", ""},
                                         {"sigma_rotation", FieldRole::kSigma, {"sigma_rot"}, "angle", "deg"}},
                              .note = "",
                              .make = [](const Tables& tables,
                                         const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
                                std::vector<std::shared_ptr<const Observation>> out;
                                for (const ViewedTable& of : tables.views("rotation", robot)) {
                                  const RowMatrixXd* measured = tables.find("rotation" + of.suffix, 4);
                                  if (measured == nullptr) continue;
                                  const RowMatrixXd* sigma =
                                      tables.find_sigma("sigma_rotation" + of.suffix, 1,
                                                        [&](Eigen::Index i) { return !measured->row(i).hasNaN(); });
                                  out.push_back(std::make_shared<Orientation>(
                                      *measured, sigma == nullptr ? Eigen::VectorXd() : sigma->col(0).eval(), of));
                                }
                                return out;
                              }})

}  // namespace fastcal
