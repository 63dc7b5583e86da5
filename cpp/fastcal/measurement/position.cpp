// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A point: the tool's position in the measuring frame, as a tracker or a camera gives it.
//   r = p - p_measured [m]; a coordinate may be missing.
#include <cmath>

#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

class Position : public Observation {
 public:
  Position(RowMatrixXd measured, RowMatrixXd sigma, int frame)
      : measured_(std::move(measured)), sigma_(std::move(sigma)), frame_(frame) {}

  std::string name() const override { return "position"; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"x", "y", "z"};
    return names;
  }
  std::string unit() const override { return "m"; }
  std::string field() const override { return "position"; }
  std::vector<int> frames() const override { return {frame_}; }
  double sigma(Eigen::Index row, int component) const override {
    return sigma_.size() == 0 ? 0 : sigma_(row, component);
  }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return true; }
  bool is_pose() const override { return true; }
  const RowMatrixXd* coordinates() const override { return &measured_; }

  void compare(Eigen::Index row, const Sights& sights, const double*, Comparison& out) const override {
    for (int c = 0; c < 3; ++c) {
      if (std::isnan(measured_(row, c))) continue;
      out.present[c] = true;
      out.r[c] = sights[0].p[c] - measured_(row, c);
      out.by_frame[0](c, c) = 1;
    }
  }

  void add_pose(Eigen::Index row, MeasuredPose& pose) const override {
    if (measured_.row(row).hasNaN()) return;
    pose.has_point = true;
    pose.p_world_tool = measured_.row(row).transpose();
  }

 private:
  RowMatrixXd measured_, sigma_;
  int frame_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "position",
    {.plural = "positions",
     .fields = {{"position", FieldRole::kMeasured, {"x", "y", "z"}, "length", "mm"},
                {"sigma_position", FieldRole::kSigma, {"sigma_x", "sigma_y", "sigma_z"}, "length", "mm"}},
     .note = "",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       const RowMatrixXd* measured = tables.find("position", 3);
       if (measured == nullptr) return {};
       const RowMatrixXd* sigma = tables.find_sigma(
           "sigma_position", 3, [&](Eigen::Index i) { return !measured->row(i).array().isNaN().all(); });
       return {std::make_shared<Position>(*measured, sigma == nullptr ? RowMatrixXd() : *sigma,
                                          tool_frame(robot.joint_count()))};
     }})

}  // namespace fastcal
