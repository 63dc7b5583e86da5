// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/measurements.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

/// What is read of several targets and shares its unknowns, as a socket that two arms touch: a reading of each target.
/// Its rows are those of the first target, then those of the next.
class OfTargets : public Observation {
 public:
  OfTargets(std::shared_ptr<const Observation> of, std::vector<int> targets, Eigen::Index rows)
      : of_(std::move(of)), targets_(std::move(targets)), rows_(rows) {}

  std::string name() const override { return of_->name(); }
  const std::vector<std::string>& components() const override { return of_->components(); }
  std::string field() const override { return of_->field(); }
  std::string unit() const override { return of_->unit(); }
  std::vector<int> frames() const override { return targets_; }
  const std::vector<Parameter>& parameters() const override { return of_->parameters(); }
  int reading_count() const override { return static_cast<int>(targets_.size()); }
  void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const override {
    compare_reading(row, 0, sights, unknowns, out);
  }
  void compare_reading(Eigen::Index row, int reading, const Sights& sights, const double* unknowns,
                       Comparison& out) const override {
    const auto k = static_cast<std::size_t>(reading);
    of_->compare(reading * rows_ + row, {sights[k]}, unknowns, out);
    if (k == 0) return;
    out.by_frame[k] = out.by_frame[0];
    out.by_frame[0].setZero();
  }
  double sigma(Eigen::Index row, int number) const override {
    const int each = static_cast<int>(components().size());
    return of_->sigma(number / each * rows_ + row, number % each);
  }
  bool claims_sigma() const override { return of_->claims_sigma(); }
  bool shows_base() const override { return of_->shows_base(); }
  bool shows_tool() const override { return of_->shows_tool(); }
  bool shows_tool_turn() const override { return of_->shows_tool_turn(); }
  bool shows_scale() const override { return of_->shows_scale(); }
  std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const override {
    std::vector<Sights> own;
    for (std::size_t k = 0; k < targets_.size(); ++k) {
      for (const Sights& row : sights) own.push_back({row[k]});
    }
    return of_->start(own, unknowns);
  }

 private:
  std::shared_ptr<const Observation> of_;
  std::vector<int> targets_;
  Eigen::Index rows_;
};

/// The tables of a labelled kind as one arm's, the rows of these targets ("@TARGET") one after the other.
Tables of_targets(const Tables& tables, const ObservationEntry& entry, const std::vector<ViewedTable>& targets) {
  const Eigen::Index rows = tables.rows;
  Tables out{rows * static_cast<Eigen::Index>(targets.size()), {}, {}};
  for (const Field& field : entry.fields) {
    for (std::size_t k = 0; k < targets.size(); ++k) {
      const Eigen::Index first = static_cast<Eigen::Index>(k) * rows;
      if (field.role == FieldRole::kLabel) {
        const Labels& own = *tables.find_labels(field.name + targets[k].suffix);
        Labels& all = out.labels[field.name];
        if (k == 0) all.codes.setConstant(out.rows, -1);
        for (std::size_t code = 0; code < own.names.size(); ++code) {
          const auto found = std::find(all.names.begin(), all.names.end(), own.names[code]);
          const auto to = static_cast<int>(found - all.names.begin());
          if (found == all.names.end()) all.names.push_back(own.names[code]);
          for (Eigen::Index i = 0; i < rows; ++i) {
            if (own.codes[i] == static_cast<int>(code)) all.codes[first + i] = to;
          }
        }
        continue;
      }
      const auto columns = static_cast<Eigen::Index>(field.columns.size());
      const RowMatrixXd* own = tables.find(field.name + targets[k].suffix, columns);
      if (own == nullptr && field.role == FieldRole::kSigma) {
        out.numbers.erase(field.name);  // of one target none are claimed, so they are found
        break;
      }
      if (own == nullptr) continue;
      RowMatrixXd& all = out.numbers[field.name];
      if (all.size() == 0) all.setConstant(out.rows, columns, std::numeric_limits<double>::quiet_NaN());
      all.middleRows(first, rows) = *own;
    }
  }
  return out;
}

std::vector<std::shared_ptr<const Observation>> all_read(const Tables& tables, const RobotModel& robot) {
  std::vector<std::shared_ptr<const Observation>> out;
  std::string known;
  for (const std::string& name : observation_names()) {
    const ObservationEntry& entry = observation_entry(name);
    known += (known.empty() ? "" : ", ") + entry.plural;
    const std::vector<ViewedTable> targets = tables.label_views(entry, robot);
    if (targets.empty()) {
      for (auto& observation : entry.make(tables, robot)) out.push_back(std::move(observation));
      continue;
    }
    std::vector<int> frames;
    Tables others = tables;
    for (const ViewedTable& of : targets) {
      frames.push_back(of.view.target);
      for (const Field& field : entry.fields) {
        if (field.role == FieldRole::kMeasured) others.numbers.erase(field.name + of.suffix);
      }
    }
    for (auto& observation : entry.make(others, robot)) out.push_back(std::move(observation));
    for (auto& observation : entry.make(of_targets(tables, entry, targets), robot))
      out.push_back(std::make_shared<OfTargets>(std::move(observation), frames, tables.rows));
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
  void compare_all(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out,
                   const std::function<void(int)>& take) const override {
    of_->compare_all(rows_[row], sights, unknowns, out, take);
  }
  double sigma(Eigen::Index row, int component) const override { return of_->sigma(rows_[row], component); }
  bool claims_sigma() const override { return of_->claims_sigma(); }
  bool is_known() const override { return of_->is_known(); }
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
