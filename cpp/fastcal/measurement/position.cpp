// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A point: the tool's position in the measuring frame, as a tracker or a camera gives it; or that of any frame, from an
// instrument that stands on another one.
//   r = A (p - p_measured) [m], p = R_sensor^T (p_world_target - p_world_sensor);  A = 1, and a coordinate may be
// missing.
// Where the row gives the instrument's place (table "instrument", NaN: it doesn't), the rows of A are its beam and
// the level and the upright direction across: an instrument that is surer along its beam than across it has independent
// errors there, and the standard deviations are along these, S = A^T diag(s_i^2) A.
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

/// Rows: along a beam, across it level, across it upright.
Eigen::Matrix3d beam_axes(const Eigen::Vector3d& beam) {
  const Eigen::Vector3d along = beam.normalized();
  const Eigen::Vector3d side = Eigen::Vector3d::UnitZ().cross(along);
  const Eigen::Vector3d level = side.norm() > 1e-9 ? side.normalized().eval() : Eigen::Vector3d::UnitY();
  Eigen::Matrix3d out;
  out << along.transpose(), level.transpose(), along.cross(level).normalized().transpose();
  return out;
}

/// A of each row; empty where no row gives the instrument's place.
std::vector<Eigen::Matrix3d> axes_of(const RowMatrixXd& measured, const RowMatrixXd* instrument) {
  if (instrument == nullptr) return {};
  std::vector<Eigen::Matrix3d> out(static_cast<std::size_t>(measured.rows()), Eigen::Matrix3d::Identity());
  for (Eigen::Index i = 0; i < measured.rows(); ++i) {
    if (instrument->row(i).hasNaN() || measured.row(i).array().isNaN().all()) continue;
    const Eigen::Vector3d beam = (measured.row(i) - instrument->row(i)).transpose();
    FASTCAL_CHECK(beam.norm() > 0) << "row " << i
                                   << ": a point seen from an instrument must be whole and apart from it";
    out[static_cast<std::size_t>(i)] = beam_axes(beam);
  }
  return out;
}

class Position : public Observation {
 public:
  Position(const RowMatrixXd& measured, const RowMatrixXd* sigma, const RowMatrixXd* instrument, const ViewedTable& of,
           bool is_end)
      : measured_(measured), axes_(axes_of(measured, instrument)), of_(of), is_end_(is_end) {
    if (sigma != nullptr) sigma_ = *sigma;
  }

  std::string name() const override { return "position" + of_.suffix; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"x", "y", "z"};
    return names;
  }
  std::string unit() const override { return "m"; }
  std::string field() const override { return "position" + of_.suffix; }
  std::vector<int> frames() const override { return frames_of(of_.view); }
  double sigma(Eigen::Index row, int component) const override {
    return sigma_.size() == 0 ? 0 : sigma_(row, component);
  }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return true; }
  bool is_pose() const override { return of_.suffix.empty(); }
  const RowMatrixXd* coordinates() const override { return axes_.empty() && is_end_ ? &measured_ : nullptr; }

  void compare(Eigen::Index row, const Sights& sights, const double*, Comparison& out) const override {
    if (of_.view.sensor != kWorldFrame) return compare_from_sensor(row, sights, out);
    if (!axes_.empty() && !measured_.row(row).hasNaN()) {
      const Eigen::Matrix3d& A = axes_[static_cast<std::size_t>(row)];
      out.present.fill(true);
      out.r = A * (sights[0].p - measured_.row(row).transpose());
      out.by_frame[0].leftCols<3>() = A;
      return;
    }
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
  void compare_from_sensor(Eigen::Index row, const Sights& sights, Comparison& out) const {
    const Eigen::Matrix3d R = sights[1].R.transpose();
    const Eigen::Vector3d line = sights[0].p - sights[1].p;
    const Eigen::Vector3d p = R * line;
    const Eigen::Matrix3d by_turn = R * skew(line);
    for (int c = 0; c < 3; ++c) {
      if (std::isnan(measured_(row, c))) continue;
      out.present[c] = true;
      out.r[c] = p[c] - measured_(row, c);
      out.by_frame[0].row(c).head<3>() = R.row(c);
      out.by_frame[1].row(c) << -R.row(c), by_turn.row(c);
    }
  }

  RowMatrixXd measured_, sigma_;
  std::vector<Eigen::Matrix3d> axes_;
  ViewedTable of_;
  bool is_end_;  // of an arm, from the measuring frame: the kernels then need no slopes
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "position",
    {.plural = "positions",
     .fields = {{"position", FieldRole::kMeasured, {"x", "y", "z"}, "length", "mm"},
                {"sigma_position", FieldRole::kSigma, {"sigma_x", "sigma_y", "sigma_z"}, "length", "mm"}},
     .note = "",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       std::vector<std::shared_ptr<const Observation>> out;
       for (const ViewedTable& of : tables.views("position", robot)) {
         const RowMatrixXd* measured = tables.find("position" + of.suffix, 3);
         if (measured == nullptr) continue;
         const RowMatrixXd* sigma = tables.find_sigma(
             "sigma_position" + of.suffix, 3, [&](Eigen::Index i) { return !measured->row(i).array().isNaN().all(); });
         const RowMatrixXd* instrument = of.suffix.empty() ? tables.find("instrument", 3) : nullptr;
         const bool is_end = robot.tree().is_serial() && of.suffix.empty();
         out.push_back(std::make_shared<Position>(*measured, sigma, instrument, of, is_end));
       }
       return out;
     }})

}  // namespace fastcal
