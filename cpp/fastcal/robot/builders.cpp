// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The four kinds of geometry, each written as its elementary motions.
#include <algorithm>
#include <string>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/robot/robot_model.hpp"
#include "fastcal/robot/tables_with_flange.hpp"

namespace fastcal {
namespace {

constexpr double kSigma = 1e-3;  // [m] and [rad], as base and tool

Parameter parameter(int joint, const std::string& name, const std::string& unit, const std::string& doc) {
  return {"joint" + std::to_string(joint + 1), name, unit, kSigma, doc};
}

/// Along a, or along d where a is 0. An identified table has millimetres where the nominal one has 0: the link stays
/// the same one.
Eigen::Vector3d beam_axis(const Eigen::Vector3d& a, double d) {
  constexpr double kNoMore = 0.02;  // of d
  return a.norm() >= std::max(kShortestLink, kNoMore * std::abs(d)) ? a : Eigen::Vector3d(0, 0, d);
}

void check_rows(const RobotDescription& description, Eigen::Index rows, Eigen::Index cols, Eigen::Index wanted_cols) {
  const auto n = static_cast<Eigen::Index>(description.joint_types.size());
  FASTCAL_CHECK(rows == n && cols == wanted_cols)
      << "the geometry table must be " << n << " x " << wanted_cols << ", got " << rows << " x " << cols;
}

void add_theta(RobotModel& model, int joint, double value) {
  model.add_parameter(Motion::kRz, value, parameter(joint, "theta", "rad", "joint angle offset"));
}
void add_d(RobotModel& model, int joint, double value) {
  model.add_parameter(Motion::kTz, value, parameter(joint, "d", "m", "offset along the joint axis"));
}
void add_a(RobotModel& model, int joint, double value) {
  model.add_parameter(Motion::kTx, value, parameter(joint, "a", "m", "link length"));
}
void add_alpha(RobotModel& model, int joint, double value) {
  model.add_parameter(Motion::kRx, value, parameter(joint, "alpha", "rad", "link twist"));
}
void add_beta(RobotModel& model, int joint, double value) {
  model.add_parameter(Motion::kRy, value,
                      parameter(joint, "beta", "rad", "tilt about y (Hayati), for nearly parallel axes"));
}

/// Nothing where it is the row's own frame, so that such a chain is the same to the last bit.
void add_flange(RobotModel& model, const Pose& flange) {
  if (!flange.R.isIdentity(0) || !flange.p.isZero(0)) model.add_constant(flange);
}

}  // namespace

RobotModel build_dh(RobotDescription description, const RowMatrixXd& rows) {
  return build_dh(std::move(description), rows, Pose());
}

RobotModel build_dh(RobotDescription description, const RowMatrixXd& rows, const Pose& flange) {
  check_rows(description, rows.rows(), rows.cols(), 5);
  RobotModel model(std::move(description));
  for (int i = 0; i < model.joint_count(); ++i) {
    model.open_branch(i, false);
    add_theta(model, i, rows(i, 0));
    model.add_joint();
    add_d(model, i, rows(i, 1));
    add_a(model, i, rows(i, 2));
    add_alpha(model, i, rows(i, 3));
    add_beta(model, i, rows(i, 4));
    model.add_body_frame();
    if (i + 1 == model.joint_count()) add_flange(model, flange);
    model.add_link_end();
    model.set_link_axis(i, beam_axis({rows(i, 2), 0, 0}, rows(i, 1)));
  }
  model.finish();
  return model;
}

RobotModel build_mdh(RobotDescription description, const RowMatrixXd& rows) {
  return build_mdh(std::move(description), rows, Pose());
}

RobotModel build_mdh(RobotDescription description, const RowMatrixXd& rows, const Pose& flange) {
  check_rows(description, rows.rows(), rows.cols(), 5);
  RobotModel model(std::move(description));
  for (int i = 0; i < model.joint_count(); ++i) {
    model.open_branch(i, true);
    add_alpha(model, i, rows(i, 3));
    add_a(model, i, rows(i, 2));
    if (model.follows(i)) model.add_link_end();
    add_theta(model, i, rows(i, 0));
    model.add_joint();
    add_d(model, i, rows(i, 1));
    add_beta(model, i, rows(i, 4));
    model.add_body_frame();
    const double a = i + 1 < model.joint_count() && model.follows(i + 1) ? rows(i + 1, 2) : 0;
    const Eigen::Vector3d x = Eigen::AngleAxisd(rows(i, 4), Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitX();
    model.set_link_axis(i, beam_axis(a * x, rows(i, 1)));
  }
  add_flange(model, flange);
  model.add_link_end();
  model.finish();
  return model;
}

RobotModel build_poe(RobotDescription description, const RowMatrixXd& screws, const Pose& home) {
  check_rows(description, screws.rows(), screws.cols(), 7);
  FASTCAL_CHECK(description.parents.empty()) << "screws describe an arm without branches";
  RobotModel model(std::move(description));
  for (int i = 0; i < model.joint_count(); ++i) {
    const bool revolute = model.description().joint_types[static_cast<std::size_t>(i)] == JointType::kRevolute;
    const Eigen::Vector3d omega = screws.row(i).head<3>();
    const Eigen::Vector3d v = screws.row(i).segment<3>(3);
    const Eigen::Vector3d direction = revolute ? omega : v;
    FASTCAL_CHECK(std::abs(direction.norm() - 1) < 1e-6)
        << "joint" << i + 1 << ": the screw's direction must have length 1, got " << direction.norm();
    FASTCAL_CHECK(!revolute || std::abs(omega.dot(v)) < 1e-9 * (1 + v.norm()))
        << "joint" << i + 1
        << ": v must be perpendicular to omega (a screw without pitch), got omega . v = " << omega.dot(v);
    const Pose axis{rotation_to_axis(direction.normalized()),
                    revolute ? omega.cross(v).eval() : Eigen::Vector3d::Zero()};
    const int first = static_cast<int>(model.parameters().size());
    model.add_constant(axis);
    model.add_parameter(Motion::kTx, 0,
                        parameter(i, "x", "m", "shift of the axis along the first direction across it"));
    model.add_parameter(Motion::kTy, 0,
                        parameter(i, "y", "m", "shift of the axis along the second direction across it"));
    model.add_parameter(Motion::kRx, 0,
                        parameter(i, "rx", "rad", "tilt of the axis about the first direction across it"));
    model.add_parameter(Motion::kRy, 0,
                        parameter(i, "ry", "rad", "tilt of the axis about the second direction across it"));
    if (i > 0) model.add_link_end();
    if (revolute)
      add_theta(model, i, screws(i, 6));
    else
      add_d(model, i, screws(i, 6));
    model.add_joint();
    model.repeat_parameter(Motion::kRy, first + 3, -1);
    model.repeat_parameter(Motion::kRx, first + 2, -1);
    model.repeat_parameter(Motion::kTy, first + 1, -1);
    model.repeat_parameter(Motion::kTx, first, -1);
    model.add_constant(axis.inverse());
    model.add_body_frame();
  }
  model.add_constant(home);
  model.add_link_end();
  model.finish();
  return model;
}

RobotModel build_urdf(RobotDescription description, const std::vector<Pose>& origins, const RowMatrixXd& axes,
                      const Pose& flange) {
  check_rows(description, static_cast<Eigen::Index>(origins.size()), axes.cols(), 3);
  check_rows(description, axes.rows(), axes.cols(), 3);
  RobotModel model(std::move(description));
  for (int i = 0; i < model.joint_count(); ++i) {
    const Eigen::Vector3d axis = axes.row(i);
    FASTCAL_CHECK(std::abs(axis.norm() - 1) < 1e-6)
        << "joint" << i + 1 << ": the axis must have length 1, got " << axis.norm();
    const Pose align{rotation_to_axis(axis.normalized()), Eigen::Vector3d::Zero()};
    model.open_branch(i, true);
    model.add_constant(origins[static_cast<std::size_t>(i)]);
    model.add_parameter(Motion::kTx, 0, parameter(i, "x", "m", "shift of the joint's origin along its own x"));
    model.add_parameter(Motion::kTy, 0, parameter(i, "y", "m", "shift of the joint's origin along its own y"));
    model.add_parameter(Motion::kTz, 0, parameter(i, "z", "m", "shift of the joint's origin along its own z"));
    model.add_parameter(Motion::kRx, 0, parameter(i, "rx", "rad", "turn of the joint's origin about its own x"));
    model.add_parameter(Motion::kRy, 0, parameter(i, "ry", "rad", "turn of the joint's origin about its own y"));
    model.add_parameter(Motion::kRz, 0, parameter(i, "rz", "rad", "turn of the joint's origin about its own z"));
    model.add_constant(align);
    if (model.follows(i)) model.add_link_end();
    model.add_joint();
    model.add_constant(align.inverse());
    model.add_body_frame();
  }
  model.add_constant(flange);
  model.add_link_end();
  model.finish();
  return model;
}

}  // namespace fastcal
