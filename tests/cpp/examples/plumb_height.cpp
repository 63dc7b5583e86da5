// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A height over a level floor, as an ultrasonic sensor or a plumb line reads it:
//   r = p_z - f - h [m], h the reading, f the floor's height in the measuring frame, identified.
// In a cell it is read of any target, in columns such as plumb_mm@smr, each target over a floor of its own.
// tests/python/calibration/test_own_observation.py takes it through the commands: this file is all that it needs.
#include <cmath>

#include "fastcal/measurement/registry.hpp"

namespace fastcal {
namespace {

class PlumbHeight : public Observation {
 public:
  PlumbHeight(Eigen::VectorXd height, Eigen::VectorXd sigma, ViewedTable of)
      : height_(std::move(height)),
        sigma_(std::move(sigma)),
        of_(std::move(of)),
        parameters_{{"floor" + of_.suffix, "height", "m", 1e-3, "of the floor in the measuring frame"}} {}

  std::string name() const override { return "plumb" + of_.suffix; }
  const std::vector<std::string>& components() const override {
    static const std::vector<std::string> names{"height"};
    return names;
  }
  std::string field() const override { return "plumb" + of_.suffix; }
  std::string unit() const override { return "m"; }
  std::vector<int> frames() const override { return {of_.view.target}; }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double sigma(Eigen::Index row, int /*number*/) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return false; }

  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    if (std::isnan(height_[row])) return;
    out.unknown_count = 1;
    out.present[0] = true;
    out.r[0] = sights[0].p.z() - unknowns[0] - height_[row];
    out.by_frame[0](0, 2) = 1;
    out.by_unknown(0, 0) = -1;
  }

  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    double sum = 0, count = 0;
    for (Eigen::Index i = 0; i < height_.size(); ++i) {
      if (std::isnan(height_[i])) continue;
      sum += sights[static_cast<std::size_t>(i)][0].p.z() - height_[i];
      ++count;
    }
    if (count == 0) return "no height over the floor was read";
    unknowns[0] = sum / count;
    return "";
  }

 private:
  Eigen::VectorXd height_, sigma_;
  ViewedTable of_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_OBSERVATION("plumb",
                             {.plural = "heights over the floor",
                              .fields = {{"plumb", FieldRole::kMeasured, {"plumb"}, "length", "mm"},
                                         {"sigma_plumb", FieldRole::kSigma, {"sigma_plumb"}, "length", "mm"}},
                              .note = "",
                              .make = [](const Tables& tables,
                                         const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
                                std::vector<std::shared_ptr<const Observation>> out;
                                for (const ViewedTable& of : tables.views("plumb", robot)) {
                                  if (of.view.sensor != kWorldFrame) continue;  // heights are over a floor of the world
                                  const RowMatrixXd* height = tables.find("plumb" + of.suffix, 1);
                                  const RowMatrixXd* sigma =
                                      tables.find_sigma("sigma_plumb" + of.suffix, 1,
                                                        [&](Eigen::Index i) { return !std::isnan((*height)(i, 0)); });
                                  out.push_back(std::make_shared<PlumbHeight>(
                                      height->col(0), sigma == nullptr ? Eigen::VectorXd() : sigma->col(0).eval(), of));
                                }
                                return out;
                              }})

}  // namespace fastcal
