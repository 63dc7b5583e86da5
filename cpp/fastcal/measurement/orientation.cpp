// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An orientation of the tool in the measuring frame, a unit quaternion.
//   r = log(R_measured^T R) [rad], the turn in the axes of the tool.
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

class Orientation : public Observation {
 public:
  Orientation(RowMatrixXd wxyz, Eigen::VectorXd sigma, int frame)
      : wxyz_(std::move(wxyz)), sigma_(std::move(sigma)), frame_(frame) {
    for (Eigen::Index i = 0; i < wxyz_.rows(); ++i) {
      if (wxyz_.row(i).hasNaN()) continue;
      const double length = wxyz_.row(i).norm();
      FASTCAL_CHECK(std::abs(length - 1) < 1e-3) << "row " << i << ": a quaternion must have length 1, got " << length;
    }
  }

  std::string name() const override { return "orientation"; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"rx", "ry", "rz"};
    return names;
  }
  std::string unit() const override { return "rad"; }
  std::string field() const override { return "rotation"; }
  std::vector<int> frames() const override { return {frame_}; }
  double sigma(Eigen::Index row, int) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return true; }
  bool is_pose() const override { return true; }
  bool shows_tool_turn() const override { return true; }

  void compare(Eigen::Index row, const Sights& sights, const double*, Comparison& out) const override {
    if (wxyz_.row(row).hasNaN()) return;
    const Eigen::Matrix3d R_measured = quaternion_to_rotation(wxyz_.row(row).transpose());
    out.r = log_so3(R_measured.transpose() * sights[0].R);
    out.by_frame[0].rightCols<3>() = right_jacobian_inverse_so3(out.r) * sights[0].R.transpose();
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
  int frame_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "orientation",
    {.plural = "orientations",
     .fields = {{"rotation", FieldRole::kMeasured, {"qw", "qx", "qy", "qz"}, "", ""},
                {"sigma_rotation", FieldRole::kSigma, {"sigma_rot"}, "angle", "deg"}},
     .note = "",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       const RowMatrixXd* measured = tables.find("rotation", 4);
       if (measured == nullptr) return {};
       const RowMatrixXd* sigma =
           tables.find_sigma("sigma_rotation", 1, [&](Eigen::Index i) { return !measured->row(i).hasNaN(); });
       return {std::make_shared<Orientation>(*measured, sigma == nullptr ? Eigen::VectorXd() : sigma->col(0).eval(),
                                             tool_frame(robot.joint_count()))};
     }})

}  // namespace fastcal
