// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Names to kinds of observation. A kind registers itself in its own file, with the columns of a file that it is read
// from; nothing else needs editing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fastcal/measurement/observation.hpp"
#include "fastcal/measurement/rig.hpp"

namespace fastcal {

/// A table of a field and between which frames it was measured.
struct ViewedTable {
  std::string suffix;  ///< "@TARGET" or "@TARGET:SENSOR"; empty: of the robot's own view
  View view;
};

/// The frames that an observation of a view looks at: the target, and the sensor where that is one of the robot's.
inline std::vector<int> frames_of(const View& view) {
  return view.sensor == kWorldFrame ? std::vector<int>{view.target} : std::vector<int>{view.target, view.sensor};
}

/// Labels of N rows as indices into their names; -1: none.
struct Labels {
  Eigen::VectorXi codes;
  std::vector<std::string> names;
};

/// What a data set holds, by field; SI, NaN where not measured.
struct Tables {
  Eigen::Index rows = 0;
  std::map<std::string, RowMatrixXd> numbers;
  std::map<std::string, Labels> labels;
  Rig rig{};  ///< cameras and boards of the cell; the columns of corners are by camera, board and corner

  /// The field (rows, columns), null where there is none; throws InvalidInput where its shape is another or a number is
  /// infinite.
  const RowMatrixXd* find(const std::string& field, Eigen::Index columns) const;
  /// The same of standard deviations, which must be positive in rows that are `measured`.
  const RowMatrixXd* find_sigma(const std::string& field, Eigen::Index columns,
                                const std::function<bool(Eigen::Index)>& measured) const;
  const Labels* find_labels(const std::string& field) const;
  /// The tables of a field: that of its own name, and "position@TARGET:SENSOR" of other frames.
  std::vector<ViewedTable> views(const std::string& field, const RobotModel& robot) const;
  /// The targets of the labels of a kind, "socket@TARGET"; throws InvalidInput where one is read from a sensor, or
  /// there are more than one observation looks at.
  std::vector<ViewedTable> label_views(const struct ObservationEntry& entry, const RobotModel& robot) const;
};

enum class FieldRole { kMeasured, kSigma, kLabel };

/// One table of a data set and the columns of a file that it is read from, without their units.
struct Field {
  std::string name;  ///< "position"; of each link: "tilt", the table of link 2 being "tilt@link2"
  FieldRole role = FieldRole::kMeasured;
  std::vector<std::string>
      columns;               ///< "x", "y", "z"; of each link "tilt_x", which a file writes as "tilt_x_mrad@link2"
  std::string quantity;      ///< "length", "angle", "pixel" as fastcal.units has them; empty: plain numbers or labels
  std::string written_unit;  ///< "mm": in which it is written
  bool each_link = false;
};

struct ObservationEntry {
  std::string plural;         ///< "positions"
  std::vector<Field> fields;  ///< measured ones first; a field of sigma may be another kind's too
  std::string note;           ///< for a reader of a data set that has it; may be empty
  std::function<std::vector<std::shared_ptr<const Observation>>(const Tables&, const RobotModel&)> make;
  int labelled = 1;  ///< numbers of a row whose label alone says that something was measured
};

/// Registered names, sorted.
std::vector<std::string> observation_names();
const ObservationEntry& observation_entry(const std::string& name);

/// Returns true, so that a namespace-scope constant can call it.
bool register_observation(const std::string& name, ObservationEntry entry);

}  // namespace fastcal

#define FASTCAL_REGISTER_OBSERVATION(name, ...)                                                 \
  namespace {                                                                                   \
  [[maybe_unused]] const bool kRegistered = ::fastcal::register_observation(name, __VA_ARGS__); \
  }
