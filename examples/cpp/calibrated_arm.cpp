// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A calibrated arm in a controller's loop: forward kinematics and inverse kinematics of a 6R arm whose geometry and
// joint compliances were identified, microseconds a call. It also solves many poses at once, and checks that each
// solution brings the tool to its target. Its exit status is 0 if all do.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "fastcal/effects/registry.hpp"
#include "fastcal/ik/inverse_kinematics.hpp"
#include "fastcal/ik/pose_solver.hpp"
#include "fastcal/robot/robot_model.hpp"

namespace {

constexpr int kJoints = 6;
constexpr int kPoses = 1000;
constexpr double kTolerance = 1e-9;  // [m] and [rad]

/// As `fastcal calibrate` identified it: rows theta [rad], d [m], a [m], alpha [rad], beta [rad], and joint
/// compliances.
fastcal::ErrorModel calibrated_arm() {
  fastcal::RowMatrixXd rows(kJoints, 5);
  rows << 0.00012, 0.40021, 0.15007, -1.57066, 0,  //
      -1.57102, 0, 0.82531, 0.00008, -0.00011,     //
      1.57061, 0, 0.10012, 1.57091, 0,             //
      -0.00032, 0.92488, 0, -1.57085, 0,           //
      0.00021, 0, -0.00004, 1.57072, 0,            //
      0, 0.11, 0, 0, 0;
  fastcal::RobotDescription description;
  description.joint_types.assign(kJoints, fastcal::JointType::kRevolute);
  description.T_flange_tool.p = {0.12, 0.04, 0.15};
  description.bodies.resize(kJoints);
  const double masses[kJoints] = {40, 25, 20, 10, 5, 2};  // [kg]
  for (int i = 0; i < kJoints; ++i) description.bodies[static_cast<std::size_t>(i)].mass = masses[i];
  const fastcal::RobotModel robot = fastcal::build_dh(description, rows);

  std::vector<std::shared_ptr<const fastcal::Effect>> effects;
  for (int i = 1; i <= kJoints; ++i)
    effects.push_back(fastcal::make_effect("joint_compliance", robot, "joint" + std::to_string(i), {}));
  Eigen::VectorXd compliance(kJoints);
  compliance << 2.1e-7, 8.4e-7, 6.9e-7, 2.2e-6, 2.5e-6, 4.1e-6;  // [rad/(N m)]
  return fastcal::ErrorModel(robot, effects, compliance);
}

/// Row `i` of postures that sweep the arm's middle.
void posture(int i, double* q) {
  for (int j = 0; j < kJoints; ++j) q[j] = 0.5 * std::sin(0.7 * i + 1.3 * j) + (j == 4 ? 0.9 : 0.1);
}

double microseconds_each(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - since).count() / kPoses;
}

void put(const fastcal::Pose& T, double* out) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> to(out);
  to.setIdentity();
  to.topLeftCorner<3, 3>() = T.R;
  to.topRightCorner<3, 1>() = T.p;
}

}  // namespace

int main() {
  const fastcal::ErrorModel model = calibrated_arm();
  fastcal::IkOptions options;
  options.limits = fastcal::RowMatrixXd(kJoints, 2);
  options.limits.col(0).setConstant(-3);
  options.limits.col(1).setConstant(3);
  options.reach = 2;
  fastcal::Samples conditions;
  conditions.q = fastcal::RowMatrixXd::Zero(1, kJoints);
  conditions.payload = Eigen::VectorXd::Constant(1, 5);  // [kg]
  fastcal::PoseSolver solver(model, conditions, options);

  fastcal::RowMatrixXd q(kPoses, kJoints), targets(kPoses, 16), seeds(kPoses, kJoints);
  for (int i = 0; i < kPoses; ++i) posture(i, q.row(i).data());
  seeds = q.array() + 0.05;

  auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kPoses; ++i) put(solver.forward(q.row(i).data()), targets.row(i).data());
  std::printf("forward kinematics: %.2f us a pose\n", microseconds_each(start));

  int reached = 0;
  fastcal::SearchPoint found;
  start = std::chrono::steady_clock::now();
  for (int i = 0; i < kPoses; ++i) {
    if (solver.solve(targets.row(i).data(), seeds.row(i).data(), found) != fastcal::IkStatus::kReached) continue;
    reached += found.position_error <= kTolerance && found.rotation_error <= kTolerance;
  }
  std::printf("inverse kinematics, one at a time: %.2f us a pose, %d of %d reached\n", microseconds_each(start),
              reached, kPoses);

  fastcal::Samples many;
  many.q = seeds;
  many.payload = Eigen::VectorXd::Constant(kPoses, 5);
  start = std::chrono::steady_clock::now();
  const fastcal::IkResult all = fastcal::inverse_kinematics(model, model.start(), many, targets, options);
  std::printf("inverse kinematics, all at once: %.2f us a pose\n", microseconds_each(start));
  const bool all_reached = all.position_error.maxCoeff() <= kTolerance && all.rotation_error.maxCoeff() <= kTolerance;
  return reached == kPoses && all_reached ? 0 : 1;
}
