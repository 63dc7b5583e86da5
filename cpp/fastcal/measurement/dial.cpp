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
#include "fastcal/measurement/by_label.hpp"

namespace fastcal {
namespace {

class Dial : public ByLabel {
 public:
  Dial(Eigen::VectorXd reading, Labels gauges, Eigen::VectorXd sigma, int frame)
      : ByLabel("dial", "reading", std::move(gauges), std::move(sigma), frame), reading_(std::move(reading)) {
    for (const char* axis : {"rx", "ry"})
      add_unknown("gauge", axis, "rad", "turn of its direction from z of the frame");
    add_unknown("gauge", "zero", "m", "where along its direction it reads zero");
    for (Eigen::Index i = 0; i < reading_.size(); ++i)
      FASTCAL_CHECK(std::isnan(reading_[i]) || code(i) >= 0)
          << "row " << i << ": a reading of a dial needs a label in column 'gauge'";
  }

  std::string field() const override { return "dial"; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    const double* own = unknowns_of(row, unknowns, out);
    if (own == nullptr) return;
    compare_along(own, sights[0].p, out);
    out.r[0] -= reading_[row];
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t g = 0; g < label_count(); ++g) {
      const std::vector<Eigen::Index> rows = rows_of(g);
      if (rows.size() < 4) return "each dial gauge needs at least four readings";
      const Places touched(sights, rows);
      Eigen::VectorXd read(touched.points.cols());
      for (std::size_t k = 0; k < rows.size(); ++k) read[static_cast<Eigen::Index>(k)] = reading_[rows[k]];
      const double mean = read.mean();
      const Eigen::MatrixXd D = touched.spread().transpose();
      const Eigen::VectorXd y = read.array() - mean;
      const Eigen::Vector3d along = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(D).solve(y);
      if (!(along.norm() > 0)) return "dial gauge " + label(g) + " reads the same everywhere";
      const Eigen::Vector3d n = along.normalized();
      unknowns.segment<3>(static_cast<Eigen::Index>(3 * g)) << turn_from_z(n), n.dot(touched.center) - mean;
    }
    return "";
  }

 protected:
  bool is_read(Eigen::Index row) const override { return !std::isnan(reading_[row]); }

 private:
  Eigen::VectorXd reading_;
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
       const auto is_read = [&](Eigen::Index i) { return !std::isnan((*read)(i, 0)); };
       return {std::make_shared<Dial>(read->col(0), *gauges, sigma_of(tables, "sigma_dial", 1, is_read),
                                      robot.view().target)};
     }})

}  // namespace fastcal
