// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/measurements.hpp"

#include <algorithm>

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

}  // namespace

Measurements::Measurements(const Tables& tables, const RobotModel& robot)
    : Measurements(tables.rows, all_read(tables, robot)) {}

Measurements::Measurements(Eigen::Index rows, const std::vector<std::shared_ptr<const Observation>>& observations)
    : rows_(rows) {
  std::vector<std::shared_ptr<const Observation>> ordered = observations;
  std::stable_partition(ordered.begin(), ordered.end(), [](const auto& o) { return o->coordinates() != nullptr; });
  for (const auto& observation : ordered) {
    PlacedObservation placed{observation,
                             number_count(),
                             static_cast<int>(observation->components().size()),
                             unknown_count(),
                             static_cast<int>(observation->parameters().size()),
                             observation->frames()};
    FASTCAL_CHECK(placed.component_count >= 1 && placed.component_count <= kMostComponents && !placed.frames.empty() &&
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

bool Measurements::shows_tool_turn() const {
  return std::any_of(observations_.begin(), observations_.end(), [](const auto& o) { return o->shows_tool_turn(); });
}

}  // namespace fastcal
