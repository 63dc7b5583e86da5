// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What was measured in N rows: several observations side by side. Their numbers lie one after the other in a row, and
// so do their unknowns behind the model's parameters.
#pragma once

#include <memory>
#include <vector>

#include "fastcal/measurement/registry.hpp"

namespace fastcal {

constexpr int kMostNumbers = 65'535;  ///< that one row may hold

/// One observation and where its numbers and unknowns are among all.
struct PlacedObservation {
  std::shared_ptr<const Observation> observation;
  int first_number = 0;
  int component_count = 0;
  int first_unknown = 0;
  int unknown_count = 0;
  std::vector<int> frames;

  const Observation* operator->() const { return observation.get(); }
};

class Measurements {
 public:
  Measurements() = default;
  /// What all registered kinds read in the tables; throws InvalidInput where one does not fit or nothing is there.
  Measurements(const Tables& tables, const RobotModel& robot);
  Measurements(Eigen::Index rows, const std::vector<std::shared_ptr<const Observation>>& observations);

  /// Some rows.
  Measurements pick(const std::vector<Eigen::Index>& rows) const;

  Eigen::Index rows() const { return rows_; }
  /// The one of positions first, where there is one.
  const std::vector<PlacedObservation>& observations() const { return observations_; }
  int observation_count() const { return static_cast<int>(observations_.size()); }
  int number_count() const { return static_cast<int>(observation_of_.size()); }
  /// The observation that number c of a row is of.
  int observation_of(int c) const { return observation_of_[c]; }
  /// Unknowns of all observations.
  const std::vector<Parameter>& parameters() const { return parameters_; }
  int unknown_count() const { return static_cast<int>(parameters_.size()); }

  /// Claimed standard deviation of number c in row i; 0 where none is claimed.
  double sigma(Eigen::Index i, int c) const {
    const PlacedObservation& of = observations_[observation_of_[c]];
    return of->sigma(i, c - of.first_number);
  }
  bool claims_sigma() const;
  bool shows_base() const;
  bool shows_tool() const;
  bool shows_tool_turn() const;
  bool shows_scale() const;

 private:
  Eigen::Index rows_ = 0;
  std::vector<PlacedObservation> observations_;
  std::vector<int> observation_of_;
  std::vector<Parameter> parameters_;
};

/// Poses that an observation looks at, out of all `frames` of the chain.
template <typename Frame>
Sights sights_of(const PlacedObservation& of, const Frame& frame) {
  Sights out;
  for (std::size_t k = 0; k < of.frames.size(); ++k) out[k] = frame(of.frames[k]);
  return out;
}

}  // namespace fastcal
