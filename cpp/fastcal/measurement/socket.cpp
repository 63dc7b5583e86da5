// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A touch of an unknown point: the tool's ball sits in a socket, always the same in rows of one label, whatever the
// posture (no instrument is needed: platonics-delft/kinematics_calibration).
//   r = R^T (p - s) [m]; the socket's place s (three numbers in the measuring frame) is identified. In the axes R of
//   the tool, what turns the arm and its sockets alike changes no residual and no derivative: in those of the measuring
//   frame the scatter of a socket's points, which is noise, would seem to show such a turn.
// Start: the mean of the points of the arm as it is. What sockets leave open: where the arm is, and the common scale
// of all lengths.
#include <cmath>

#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

class Socket : public Observation {
 public:
  Socket(Labels sockets, RowMatrixXd sigma, int frame)
      : sockets_(std::move(sockets)), sigma_(std::move(sigma)), frame_(frame) {
    for (const std::string& label : sockets_.names) {
      for (const char* axis : {"x", "y", "z"})
        parameters_.push_back({"socket " + label, axis, "m", 1e-3, "place of the socket in the measuring frame"});
    }
  }

  std::string name() const override { return "socket"; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"x", "y", "z"};
    return names;
  }
  std::string unit() const override { return "m"; }
  std::vector<int> frames() const override { return {frame_}; }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double sigma(Eigen::Index row, int) const override {
    return sigma_.size() == 0 ? 0 : sigma_.row(row).norm() / std::sqrt(3.0);  // about the axes of the tool: any
  }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return false; }
  bool shows_scale() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (sockets_.codes[row] < 0) return;
    out.first_unknown = 3 * sockets_.codes[row];
    out.unknown_count = 3;
    out.present.fill(true);
    const Eigen::Matrix3d axes = sights[0].R.transpose();
    const Eigen::Vector3d off = sights[0].p - Eigen::Map<const Eigen::Vector3d>(unknowns + out.first_unknown);
    out.r = axes * off;
    // The tool moves by v and turns by w: d r = R^T (v - w x off).
    out.by_frame[0].leftCols<3>() = axes;
    out.by_frame[0].rightCols<3>() = axes * skew(off);
    out.by_unknown.leftCols<3>() = -axes;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t s = 0; s < sockets_.names.size(); ++s) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double count = 0;
      for (Eigen::Index i = 0; i < sockets_.codes.size(); ++i) {
        if (sockets_.codes[i] != static_cast<int>(s)) continue;
        sum += sights[static_cast<std::size_t>(i)][0].p;
        ++count;
      }
      if (count < 2) return "each socket needs at least two touches";
      unknowns.segment<3>(static_cast<Eigen::Index>(3 * s)) = sum / count;
    }
    return "";
  }

 private:
  Labels sockets_;
  RowMatrixXd sigma_;
  int frame_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "socket",
    {.plural = "touches of a socket",
     .fields = {{"socket", FieldRole::kLabel, {"socket"}, "", ""},
                {"sigma_position", FieldRole::kSigma, {"sigma_x", "sigma_y", "sigma_z"}, "length", "mm"}},
     .note = "the points of each label in column 'socket' are one unknown point",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       const Labels* sockets = tables.find_labels("socket");
       if (sockets == nullptr || sockets->names.empty()) return {};
       const RowMatrixXd* sigma =
           tables.find_sigma("sigma_position", 3, [&](Eigen::Index i) { return sockets->codes[i] >= 0; });
       return {std::make_shared<Socket>(*sockets, sigma == nullptr ? RowMatrixXd() : *sigma, robot.view().target)};
     },
     .labelled = 3})

}  // namespace fastcal
