// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What observations of one number in metres share: a length, a dial's reading, a touch of a surface, each of the tool's
// point seen from the measuring frame, with unknowns for each label.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fastcal/measurement/registry.hpp"

namespace fastcal {

class OneLength : public Observation {
 public:
  std::string name() const override { return name_; }
  const std::vector<std::string>& components() const override { return components_; }
  std::string unit() const override { return "m"; }
  std::vector<int> frames() const override { return {frame_}; }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double sigma(Eigen::Index row, int) const override { return sigma_.size() == 0 ? 0 : sigma_[row]; }
  bool claims_sigma() const override { return sigma_.size() > 0; }
  bool shows_base() const override { return false; }

 protected:
  /// `component`: what a report calls the number. `sigma` [m]: of each row, or empty where none is claimed.
  OneLength(std::string name, std::string component, Eigen::VectorXd sigma, int frame)
      : name_(std::move(name)), components_{std::move(component)}, sigma_(std::move(sigma)), frame_(frame) {}

  std::vector<Parameter> parameters_;  ///< of each label; filled by the constructor of the kind

 private:
  std::string name_;
  std::vector<std::string> components_;
  Eigen::VectorXd sigma_;
  int frame_;
};

/// Turns [rx, ry] (rad) of the least turn exp([rx, ry, 0]) that brings z to the unit vector n: about z x n.
inline Eigen::Vector2d turn_from_z(const Eigen::Vector3d& n) {
  const double across = std::hypot(n.x(), n.y());
  const double by = across > 0 ? std::atan2(across, n.z()) / across : 0;
  return {-by * n.y(), by * n.x()};
}

/// Registry's entry of a kind of touch: rows with a label in column `name` are T(labels, sigma, frame of the probe).
template <class T>
ObservationEntry touches(const std::string& name, std::string note) {
  return {
      .plural = "touches of a " + name,
      .fields = {{name, FieldRole::kLabel, {name}, "", ""},
                 {"sigma_position", FieldRole::kSigma, {"sigma_x", "sigma_y", "sigma_z"}, "length", "mm"}},
      .note = std::move(note),
      .make = [name](const Tables& tables, const RobotModel& robot) -> std::vector<std::shared_ptr<const Observation>> {
        const Labels* labels = tables.find_labels(name);
        if (labels == nullptr || labels->names.empty()) return {};
        const RowMatrixXd* sigma =
            tables.find_sigma("sigma_position", 3, [&](Eigen::Index i) { return labels->codes[i] >= 0; });
        return {std::make_shared<T>(*labels, sigma == nullptr ? Eigen::VectorXd() : sigma->col(0).eval(),
                                    robot.view().target)};
      }};
}

}  // namespace fastcal
