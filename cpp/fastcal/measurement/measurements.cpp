// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/measurements.hpp"

#include <algorithm>
#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

std::vector<std::shared_ptr<const Observation>> all_read(const Tables& tables, const RobotModel& robot) {
  std::vector<std::shared_ptr<const Observation>> out;
  std::string known;
  for (const std::string& name : observation_names()) {
    known += (known.empty() ? "" : ", ") + observation_entry(name).plural;
    for (auto& observation : observation_entry(name).make(tables, robot)) out.push_back(std::move(observation));
  }
  FASTCAL_CHECK(!out.empty()) << "nothing was measured; expected " << known;
  return out;
}

/// Some rows of an observation.
class PickedRows : public Observation {
 public:
  PickedRows(std::shared_ptr<const Observation> of, std::vector<Eigen::Index> rows)
      : of_(std::move(of)), rows_(std::move(rows)) {
    if (of_->coordinates() != nullptr) coordinates_ = (*of_->coordinates())(rows_, Eigen::all);
  }

  std::string name() const override { return of_->name(); }
  const std::vector<std::string>& components() const override { return of_->components(); }
  std::string field() const override { return of_->field(); }
  std::string unit() const override { return of_->unit(); }
  std::vector<int> frames() const override { return of_->frames(); }
  const std::vector<Parameter>& parameters() const override { return of_->parameters(); }
  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    of_->compare(rows_[row], sights, unknowns, out);
  }
  int reading_count() const override { return of_->reading_count(); }
  void compare_reading(Eigen::Index row, int reading, const Sights& sights, const double* unknowns,
                       Comparison& out) const override {
    of_->compare_reading(rows_[row], reading, sights, unknowns, out);
  }
  double sigma(Eigen::Index row, int component) const override { return of_->sigma(rows_[row], component); }
  bool claims_sigma() const override { return of_->claims_sigma(); }
  bool shows_base() const override { return of_->shows_base(); }
  bool shows_tool() const override { return of_->shows_tool(); }
  bool shows_tool_turn() const override { return of_->shows_tool_turn(); }
  bool shows_scale() const override { return of_->shows_scale(); }
  bool is_pose() const override { return of_->is_pose(); }
  void add_pose(Eigen::Index row, MeasuredPose& pose) const override { of_->add_pose(rows_[row], pose); }
  const RowMatrixXd* coordinates() const override { return of_->coordinates() == nullptr ? nullptr : &coordinates_; }

 private:
  std::shared_ptr<const Observation> of_;
  std::vector<Eigen::Index> rows_;
  RowMatrixXd coordinates_;
};

}  // namespace

Measurements Measurements::pick(const std::vector<Eigen::Index>& rows) const {
  std::vector<std::shared_ptr<const Observation>> picked;
  for (const PlacedObservation& of : observations_)
    picked.push_back(std::make_shared<PickedRows>(of.observation, rows));
  return {static_cast<Eigen::Index>(rows.size()), picked};
}

Measurements::Measurements(const Tables& tables, const RobotModel& robot)
    : Measurements(tables.rows, all_read(tables, robot)) {}

Measurements::Measurements(Eigen::Index rows, const std::vector<std::shared_ptr<const Observation>>& observations)
    : rows_(rows) {
  std::vector<std::shared_ptr<const Observation>> ordered = observations;
  std::stable_partition(ordered.begin(), ordered.end(),
                        [](const auto& o) { return o->field().starts_with("position"); });
  for (const auto& observation : ordered) {
    PlacedObservation placed{observation,
                             number_count(),
                             static_cast<int>(observation->components().size()) * observation->reading_count(),
                             unknown_count(),
                             static_cast<int>(observation->parameters().size()),
                             observation->frames()};
    const int components = static_cast<int>(observation->components().size());
    FASTCAL_CHECK(components >= 1 && components <= kMostComponents && !placed.frames.empty() &&
                  placed.frames.size() <= kMostFrames)
        << observation->name() << " must have 1 to " << kMostComponents << " numbers and look at 1 to " << kMostFrames
        << " frames";
    observation_of_.insert(observation_of_.end(), placed.component_count, observation_count());
    parameters_.insert(parameters_.end(), observation->parameters().begin(), observation->parameters().end());
    observations_.push_back(std::move(placed));
  }
  FASTCAL_CHECK(number_count() <= kMostNumbers)
      << "a row may hold at most " << kMostNumbers << " measured numbers, got " << number_count();
}

bool Measurements::claims_sigma() const {
  return std::any_of(observations_.begin(), observations_.end(), [](const auto& o) { return o->claims_sigma(); });
}

bool Measurements::shows_base() const {
  return std::any_of(observations_.begin(), observations_.end(), [](const auto& o) { return o->shows_base(); });
}

bool Measurements::shows_tool() const {
  return std::any_of(observations_.begin(), observations_.end(), [](const auto& o) { return o->shows_tool(); });
}

bool Measurements::shows_tool_turn() const {
  return std::any_of(observations_.begin(), observations_.end(), [](const auto& o) { return o->shows_tool_turn(); });
}

bool Measurements::shows_scale() const {
  return std::any_of(observations_.begin(), observations_.end(), [](const auto& o) { return o->shows_scale(); });
}

}  // namespace fastcal
