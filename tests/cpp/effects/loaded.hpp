// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What physics tests of effects under load share: arms so simple that their loads are worked out by hand, in one
// posture.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fastcal/effects/registry.hpp"
#include "fastcal/model/error_model.hpp"
#include "fastcal/model/prediction.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal::test {

constexpr double kG = 9.80665;
inline const double kHalfPi = std::acos(0.0);

/// One revolute joint whose axis is level (world -y): DH, a link of 1 m along x with 10 kg in its middle, payload at
/// the flange.
inline RobotDescription level_description() {
  RobotDescription description;
  description.joint_types = {JointType::kRevolute};
  description.bodies.resize(1);
  description.bodies[0].mass = 10;
  description.bodies[0].com = {-0.5, 0, 0};
  description.T_world_base.R = Eigen::AngleAxisd(kHalfPi, Eigen::Vector3d::UnitX()).toRotationMatrix();
  description.gravity_in_world = true;
  return description;
}

inline RowMatrixXd one_row(double theta, double d, double a) {
  RowMatrixXd rows = RowMatrixXd::Zero(1, 5);
  rows.leftCols(3) << theta, d, a;
  return rows;
}

inline RobotModel level_arm(const RobotDescription& description = level_description()) {
  return build_dh(description, one_row(0, 0, 1));
}

/// An effect, its owner, its options and its values.
struct Cause {
  std::string name, owner;
  std::vector<double> values;
  Options options;
};

inline ErrorModel with(const RobotModel& robot, const std::vector<Cause>& causes) {
  std::vector<std::shared_ptr<const Effect>> effects;
  std::vector<double> values;
  for (const Cause& cause : causes) {
    effects.push_back(make_effect(cause.name, robot, cause.owner, cause.options));
    values.insert(values.end(), cause.values.begin(), cause.values.end());
  }
  return ErrorModel(robot, effects,
                    Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
}

inline Samples posture(const std::vector<double>& q, double payload = 0) {
  Samples out;
  out.q = Eigen::Map<const Eigen::RowVectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
  out.payload = Eigen::VectorXd::Constant(1, payload);
  return out;
}

/// Pose of the tool, loads settled.
inline Pose tool(const ErrorModel& model, const Samples& samples) {
  double T[16];
  predict(model, samples, model.start(), 1, T);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> M(T);
  return {M.topLeftCorner<3, 3>(), M.topRightCorner<3, 1>()};
}

/// The twists of all frames that the effects make, loads settled.
inline Twists twists(const ErrorModel& model, Samples samples) {
  settle(model, model.start(), 1, samples);
  Twists xi = Twists::Zero(6, model.robot().frame_count());
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    effect->deflect(samples.row(0), model.start().data() + first, xi, nullptr);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
  return xi;
}

}  // namespace fastcal::test
