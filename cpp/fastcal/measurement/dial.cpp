// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A dial gauge, or any probe that reads one number along its own direction, fixed in the room: the tool's point pushes
// its flat foot.
//   r = n . p - o - h [m], h the reading, n = exp([rx, ry, 0]) e_z the direction in which it grows, o the place along n
//   at which it reads zero. rx, ry, o of each gauge are identified.
// Start: h = g . p - o by linear least squares, n = g / |g|; where the points lie on a plane or a line, the shortest g.
// What a gauge leaves open: shifts across its direction and turns about it; its readings show the scale.
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/measurement/one_length.hpp"

namespace fastcal {
namespace {

class Dial : public OneLength {
 public:
  Dial(Eigen::VectorXd reading, Labels gauges, Eigen::VectorXd sigma, int frame)
      : OneLength("dial", "reading", std::move(sigma), frame),
        reading_(std::move(reading)),
        gauges_(std::move(gauges)) {
    for (const std::string& label : gauges_.names) {
      for (const char* axis : {"rx", "ry"})
        parameters_.push_back({"gauge " + label, axis, "rad", 1e-3, "turn of its direction from z of the frame"});
      parameters_.push_back({"gauge " + label, "zero", "m", 1e-3, "where along its direction it reads zero"});
    }
    for (Eigen::Index i = 0; i < reading_.size(); ++i)
      FASTCAL_CHECK(std::isnan(reading_[i]) || gauges_.codes[i] >= 0)
          << "row " << i << ": a reading of a dial needs a label in column 'gauge'";
  }

  std::string field() const override { return "dial"; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (std::isnan(reading_[row])) return;
    out.first_unknown = 3 * gauges_.codes[row];
    out.unknown_count = 3;
    const double* own = unknowns + out.first_unknown;
    const Eigen::Vector3d turn(own[0], own[1], 0);
    const Eigen::Matrix3d R = exp_so3(turn);
    out.present[0] = true;
    out.r[0] = R.col(2).dot(sights[0].p) - own[2] - reading_[row];
    out.by_frame[0].topLeftCorner<1, 3>() = R.col(2).transpose();
    // d n = R ((J_r d turn) x e_z)
    const Eigen::Matrix<double, 3, 2> by_turn =
        -R * skew(Eigen::Vector3d::UnitZ()) * right_jacobian_so3(turn).leftCols<2>();
    out.by_unknown.topLeftCorner<1, 2>() = sights[0].p.transpose() * by_turn;
    out.by_unknown(0, 2) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t g = 0; g < gauges_.names.size(); ++g) {
      std::vector<Eigen::Index> rows;
      Eigen::Vector3d center = Eigen::Vector3d::Zero();
      double mean = 0;
      for (Eigen::Index i = 0; i < reading_.size(); ++i) {
        if (gauges_.codes[i] != static_cast<int>(g) || std::isnan(reading_[i])) continue;
        rows.push_back(i);
        center += sights[static_cast<std::size_t>(i)][0].p;
        mean += reading_[i];
      }
      if (rows.size() < 4) return "each dial gauge needs at least four readings";
      center /= static_cast<double>(rows.size());
      mean /= static_cast<double>(rows.size());
      Eigen::MatrixXd D(rows.size(), 3);
      Eigen::VectorXd y(rows.size());
      for (std::size_t k = 0; k < rows.size(); ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        D.row(at) = (sights[static_cast<std::size_t>(rows[k])][0].p - center).transpose();
        y[at] = reading_[rows[k]] - mean;
      }
      const Eigen::Vector3d along = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(D).solve(y);
      if (!(along.norm() > 0)) return "dial gauge " + gauges_.names[g] + " reads the same everywhere";
      const Eigen::Vector3d n = along.normalized();
      unknowns.segment<3>(static_cast<Eigen::Index>(3 * g)) << turn_from_z(n), n.dot(center) - mean;
    }
    return "";
  }

 private:
  Eigen::VectorXd reading_;
  Labels gauges_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "dial",
    {.plural = "readings of a dial gauge",
     .fields = {{"dial", FieldRole::kMeasured, {"dial"}, "length", "mm"},
                {"gauge", FieldRole::kLabel, {"gauge"}, "", ""},
                {"sigma_dial", FieldRole::kSigma, {"sigma_dial"}, "length", "mm"}},
     .note = "",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       const RowMatrixXd* read = tables.find("dial", 1);
       if (read == nullptr) return {};
       const Labels* gauges = tables.find_labels("gauge");
       FASTCAL_CHECK(gauges != nullptr) << "readings of a dial gauge need a label in column 'gauge' in every row";
       const RowMatrixXd* sigma =
           tables.find_sigma("sigma_dial", 1, [&](Eigen::Index i) { return !std::isnan((*read)(i, 0)); });
       return {std::make_shared<Dial>(
           read->col(0), *gauges, sigma == nullptr ? Eigen::VectorXd() : sigma->col(0).eval(), robot.view().target)};
     }})

}  // namespace fastcal
