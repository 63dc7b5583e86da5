// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Observations of one number a row that the tool's point sets, with unknowns of each label: touches of a surface, the
// readings of a gauge, lengths from an anchor.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fastcal/measurement/registry.hpp"

namespace fastcal {

class ByLabel : public Observation {
 public:
  /// `component`: what its number is; sigma (N) or empty; `frame`: of the tool.
  ByLabel(std::string name, std::string component, Labels labels, Eigen::VectorXd sigma, int frame);

  std::string name() const override { return name_; }
  const std::vector<std::string>& components() const override { return components_; }
  std::string unit() const override { return "m"; }
  std::vector<int> frames() const override { return {frame_}; }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double sigma(Eigen::Index row, int) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return false; }

 protected:
  std::size_t label_count() const { return labels_.names.size(); }
  const std::string& label(std::size_t k) const { return labels_.names[k]; }
  /// The label of a row, -1: none.
  int code(Eigen::Index row) const { return labels_.codes[row]; }
  /// One more unknown of "OWNER LABEL"; all labels have the same, one label after the other.
  void add_unknown(const std::string& owner, const std::string& name, const std::string& unit,
                   const std::string& description);
  /// The unknowns of the row's label, which it gives to `out`; null where the row has none.
  const double* unknowns_of(Eigen::Index row, const double* unknowns, Comparison& out) const;
  /// The rows of a label in which something was read.
  std::vector<Eigen::Index> rows_of(std::size_t label) const;
  /// Was something read in a row?
  virtual bool is_read(Eigen::Index row) const { return code(row) >= 0; }

 private:
  std::string name_;
  std::vector<std::string> components_;
  Labels labels_;
  Eigen::VectorXd sigma_;
  int frame_;
  std::vector<Parameter> parameters_;
};

/// (3, n) places of the tool's point in these rows, and their mean.
struct Places {
  Eigen::Matrix3Xd points;
  Eigen::Vector3d center;

  Places(const std::vector<Sights>& sights, const std::vector<Eigen::Index>& rows);
  /// (3, n) from their mean.
  Eigen::Matrix3Xd spread() const { return points.colwise() - center; }
  /// The direction in which they spread least.
  Eigen::Vector3d flattest() const;
};

/// r = n . p - o of a plane or a direction, n = exp([rx, ry, 0]) e_z, and its derivatives; own: rx, ry, o.
void compare_along(const double* own, const Eigen::Vector3d& p, Comparison& out);
/// The least turn rx, ry from z to the unit vector n: about z x n, which lies in the plane of x and y.
Eigen::Vector2d turn_from_z(const Eigen::Vector3d& n);

/// The column of standard deviations in the rows in which something was read; empty: none.
template <class IsRead>
Eigen::VectorXd sigma_of(const Tables& tables, const std::string& field, Eigen::Index columns, const IsRead& is_read) {
  const RowMatrixXd* found = tables.find_sigma(field, columns, is_read);
  return found == nullptr ? Eigen::VectorXd() : found->col(0).eval();
}

/// The entry of touches, a row of which is a label in a column of the kind's name.
template <class Kind>
ObservationEntry touches(const std::string& name, const std::string& plural, const std::string& note) {
  ObservationEntry out;
  out.plural = plural;
  out.fields = {{name, FieldRole::kLabel, {name}, "", ""},
                {"sigma_position", FieldRole::kSigma, {"sigma_x", "sigma_y", "sigma_z"}, "length", "mm"}};
  out.note = note;
  out.make = [name](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
    const Labels* labels = tables.find_labels(name);
    if (labels == nullptr || labels->names.empty()) return {};
    const auto is_read = [&](Eigen::Index i) { return labels->codes[i] >= 0; };
    return {std::make_shared<Kind>(*labels, sigma_of(tables, "sigma_position", 3, is_read), robot.view().target)};
  };
  return out;
}

}  // namespace fastcal
