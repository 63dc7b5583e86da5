// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/registry.hpp"

#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

std::map<std::string, ObservationEntry>& entries() {
  static std::map<std::string, ObservationEntry> map;  // in a function: ready before the first registration
  return map;
}

}  // namespace

const RowMatrixXd* Tables::find(const std::string& field, Eigen::Index columns) const {
  const auto found = numbers.find(field);
  if (found == numbers.end() || found->second.size() == 0) return nullptr;
  const RowMatrixXd& table = found->second;
  FASTCAL_CHECK(table.rows() == rows && table.cols() == columns)
      << field << " must have " << rows << " rows and " << columns << " columns, got " << table.rows() << " and "
      << table.cols();
  FASTCAL_CHECK(!table.array().isInf().any()) << field << " must be finite, or NaN where it was not measured";
  return &table;
}

const RowMatrixXd* Tables::find_sigma(const std::string& field, Eigen::Index columns,
                                      const std::function<bool(Eigen::Index)>& measured) const {
  const RowMatrixXd* table = find(field, columns);
  for (Eigen::Index i = 0; table != nullptr && i < rows; ++i) {
    FASTCAL_CHECK(!measured(i) || (table->row(i).array() > 0).all()) << field << " must be positive and finite";
  }
  return table;
}

const Labels* Tables::find_labels(const std::string& field) const {
  const auto found = labels.find(field);
  if (found == labels.end() || found->second.codes.size() == 0) return nullptr;
  const Labels& here = found->second;
  FASTCAL_CHECK(here.codes.size() == rows) << field << " must have " << rows << " labels, got " << here.codes.size();
  const int count = static_cast<int>(here.names.size());
  for (Eigen::Index i = 0; i < rows; ++i) {
    FASTCAL_CHECK(here.codes[i] >= -1 && here.codes[i] < count)
        << "row " << i << ": " << field << " must be -1 to " << count - 1 << ", got " << here.codes[i];
  }
  return &here;
}

std::vector<ViewedTable> Tables::views(const std::string& field, const RobotModel& robot) const {
  std::vector<ViewedTable> out;
  for (const auto& [name, table] : numbers) {
    if (name == field) out.push_back({"", robot.view()});
    if (!name.starts_with(field + "@")) continue;
    const std::string suffix = name.substr(field.size());
    const View view = robot.tree().view(suffix.substr(1));
    FASTCAL_CHECK(view.target != kWorldFrame) << name << ": what is read must be a frame of the robot, got 'world'";
    out.push_back({suffix, view});
  }
  return out;
}

std::vector<ViewedTable> Tables::label_views(const ObservationEntry& entry, const RobotModel& robot) const {
  std::vector<ViewedTable> out;
  for (const Field& field : entry.fields) {
    if (field.role != FieldRole::kLabel) continue;
    for (const auto& [name, own] : labels) {
      if (!name.starts_with(field.name + "@") || find_labels(name) == nullptr) continue;
      const std::string suffix = name.substr(field.name.size());
      const View view = robot.tree().view(suffix.substr(1));
      FASTCAL_CHECK(view.sensor == kWorldFrame && view.target != kWorldFrame)
          << name << ": expected a target, as what it touches stands in the measuring frame";
      out.push_back({suffix, view});
    }
    FASTCAL_CHECK(out.size() <= static_cast<std::size_t>(kMostFrames))
        << field.name << " is read of " << out.size() << " targets; expected at most " << kMostFrames;
  }
  return out;
}

bool register_observation(const std::string& name, ObservationEntry entry) {
  FASTCAL_CHECK(entries().emplace(name, std::move(entry)).second)
      << "the observation name '" << name << "' is registered twice";
  return true;
}

std::vector<std::string> observation_names() {
  std::vector<std::string> names;
  for (const auto& [name, entry] : entries()) names.push_back(name);
  return names;
}

const ObservationEntry& observation_entry(const std::string& name) {
  const auto found = entries().find(name);
  FASTCAL_CHECK(found != entries().end()) << "no observation is called '" << name << "'";
  return found->second;
}

}  // namespace fastcal
