// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A length from an unknown anchor to the tool: wire, ball-bar, interferometer.
//   r = |p - a| - L [m]; the anchor's place a (three numbers in the measuring frame) is identified.
// Start: |p|^2 - 2 p.a + |a|^2 = L^2 is linear in [a, |a|^2].
// Between two frames of a cell, as a bar that two arms hold: r = |p_a - p_b| - L, without unknowns; where L is known
// beforehand and not read, its standard deviation is all of its noise.
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/measurement/by_label.hpp"

namespace fastcal {
namespace {

class Length : public ByLabel {
 public:
  Length(Eigen::VectorXd length, Labels anchors, Eigen::VectorXd sigma, int frame)
      : ByLabel("length", "length", std::move(anchors), std::move(sigma), frame), length_(std::move(length)) {
    for (const char* axis : {"x", "y", "z"})
      add_unknown("anchor", axis, "m", "place of the anchor in the measuring frame");
    for (Eigen::Index i = 0; i < length_.size(); ++i) {
      FASTCAL_CHECK(std::isnan(length_[i]) || length_[i] >= 0) << "row " << i << ": a length must not be negative";
      FASTCAL_CHECK(std::isnan(length_[i]) || code(i) >= 0) << "row " << i << ": a length needs an anchor";
    }
  }

  std::string field() const override { return "distance"; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    const double* own = unknowns_of(row, unknowns, out);
    if (own == nullptr) return;
    const Eigen::Vector3d line = sights[0].p - Eigen::Map<const Eigen::Vector3d>(own);
    const double length = line.norm();
    out.r[0] = length - length_[row];
    // A tool in its anchor has a derivative of length 1 too.
    const Eigen::Vector3d along = length > 0 ? (line / length).eval() : Eigen::Vector3d::UnitX();
    out.by_frame[0].topLeftCorner<1, 3>() = along.transpose();
    out.by_unknown.topLeftCorner<1, 3>() = -along.transpose();
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    for (std::size_t a = 0; a < label_count(); ++a) {
      const std::vector<Eigen::Index> rows = rows_of(a);
      if (rows.size() < 4) return "each anchor needs at least four lengths";
      const Places reached(sights, rows);
      const Eigen::Matrix3Xd p = reached.spread();
      Eigen::MatrixXd D(p.cols(), 4);
      D << -2 * p.transpose(), Eigen::VectorXd::Ones(p.cols());
      Eigen::VectorXd y = -p.colwise().squaredNorm().transpose();
      for (std::size_t k = 0; k < rows.size(); ++k)
        y[static_cast<Eigen::Index>(k)] += length_[rows[k]] * length_[rows[k]];
      unknowns.segment<3>(static_cast<Eigen::Index>(3 * a)) = reached.center + least_squares(D, y).head<3>();
    }
    return "";
  }

 protected:
  bool is_read(Eigen::Index row) const override { return !std::isnan(length_[row]); }

 private:
  Eigen::VectorXd length_;
};

class Span : public Observation {
 public:
  Span(std::string field, Eigen::VectorXd length, Eigen::VectorXd sigma, ViewedTable of)
      : field_(std::move(field)), length_(std::move(length)), sigma_(std::move(sigma)), of_(std::move(of)) {
    FASTCAL_CHECK(!(length_.array() < 0).any()) << "distance" << of_.suffix << ": a length must not be negative";
  }

  std::string name() const override { return "length" + of_.suffix; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"length"};
    return names;
  }
  std::string unit() const override { return "m"; }
  std::string field() const override { return field_ + of_.suffix; }
  std::vector<int> frames() const override { return frames_of(of_.view); }
  double sigma(Eigen::Index row, int) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool is_known() const override { return field_ != "distance"; }
  bool shows_base() const override { return of_.view.sensor == kWorldFrame; }

  void compare(Eigen::Index row, const Sights& sights, const double*, Comparison& out) const override {
    if (std::isnan(length_[row])) return;
    const bool from_frame = of_.view.sensor != kWorldFrame;
    const Eigen::Vector3d line = from_frame ? (sights[0].p - sights[1].p).eval() : sights[0].p;
    const double length = line.norm();
    out.present[0] = true;
    out.r[0] = length - length_[row];
    const Eigen::Vector3d along = length > 0 ? (line / length).eval() : Eigen::Vector3d::UnitX();
    out.by_frame[0].topLeftCorner<1, 3>() = along.transpose();
    if (from_frame) out.by_frame[1].topLeftCorner<1, 3>() = -along.transpose();
  }

 private:
  std::string field_;
  Eigen::VectorXd length_, sigma_;
  ViewedTable of_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION(
    "length",
    {.plural = "lengths",
     .fields = {{"distance", FieldRole::kMeasured, {"distance"}, "length", "mm"},
                {"anchor", FieldRole::kLabel, {"anchor"}, "", ""},
                {"sigma_position", FieldRole::kSigma, {"sigma_x", "sigma_y", "sigma_z"}, "length", "mm"}},
     .note = "",
     .make = [](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
       std::vector<std::shared_ptr<const Observation>> out;
       for (const ViewedTable& of : tables.views("distance", robot)) {
         const RowMatrixXd* measured = tables.find("distance" + of.suffix, 1);
         if (measured == nullptr) continue;
         const auto is_read = [&](Eigen::Index i) { return !std::isnan((*measured)(i, 0)); };
         Eigen::VectorXd sigma = sigma_of(tables, "sigma_position" + of.suffix, 3, is_read);
         if (!of.suffix.empty()) {
           out.push_back(std::make_shared<Span>("distance", measured->col(0), std::move(sigma), of));
           continue;
         }
         const Labels* anchors = tables.find_labels("anchor");
         FASTCAL_CHECK(anchors != nullptr) << "lengths need an anchor in every row";
         out.push_back(std::make_shared<Length>(measured->col(0), *anchors, std::move(sigma), robot.view().target));
       }
       for (const ViewedTable& of : tables.views("known_distance", robot)) {
         const RowMatrixXd* known = tables.find("known_distance" + of.suffix, 1);
         const auto is_known = [&](Eigen::Index i) { return !std::isnan((*known)(i, 0)); };
         const RowMatrixXd* sigma = tables.find_sigma("sigma_known_distance" + of.suffix, 1, is_known);
         FASTCAL_CHECK(known != nullptr && sigma != nullptr) << "a known distance needs its standard deviation";
         out.push_back(std::make_shared<Span>("known_distance", known->col(0), sigma->col(0), of));
       }
       return out;
     }})

}  // namespace fastcal
