// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Reduction ratio: joint j turns by k_j times what its motor's position says, error = k_j - 1. With nominal coupling c,
//   q_j += error (q_j - sum_m c_jm q_m),   q_i += c_ij error q_j   for every joint i that j drives.
// Source: SIASUN SR210D paper, equations 13 to 15, mended as docs/effects/reduction_ratio.md says.
#include <utility>
#include <vector>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ReductionRatio : public LinearEffect {
 public:
  ReductionRatio(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("reduction_ratio", "joint", owner, robot.joint_count())),
        motion_(joint_motion(robot.description().joint_types, joint_, 1)),
        parameters_{{owner, "error", "1", 1e-3, "relative error of the reduction ratio, k - 1"}} {
    check_options("reduction_ratio", options, {});
    const RobotDescription& arm = robot.description();
    for (int i = 0; i < robot.joint_count(); ++i) {
      if (arm.coupling(joint_, i) != 0) drivers_.emplace_back(i, arm.coupling(joint_, i));
      if (arm.coupling(i, joint_) != 0)
        driven_.emplace_back(i, joint_motion(arm.joint_types, i, arm.coupling(i, joint_)));
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double output_error(int joint, const double* theta) const override { return joint == joint_ ? theta[0] : 0; }

  void basis(const State& state, TwistColumns& columns) const override {
    double own = state.q[joint_];
    for (const auto& [joint, coupling] : drivers_) own -= coupling * state.q[joint];
    columns.push_back({0, joint_frame(joint_), motion_ * own});
    for (const auto& [joint, motion] : driven_) columns.push_back({0, joint_frame(joint), motion * state.q[joint_]});
  }

  bool add_basis(const Samples& samples, Eigen::Index begin, int rows, TwistTable& table) const override {
    const auto add = [&](int moved, const Vector6d& motion, int from) {
      const int part = motion[2] != 0 ? 2 : 5;
      double* out = table.part(0, joint_frame(moved), part);
      for (int i = 0; i < rows; ++i) out[i] += motion[part] * samples.q(begin + i, from);
    };
    add(joint_, motion_, joint_);
    for (const auto& [joint, coupling] : drivers_) add(joint_, -coupling * motion_, joint);
    for (const auto& [joint, motion] : driven_) add(joint, motion, joint_);
    return true;
  }

 private:
  int joint_;
  Vector6d motion_;
  std::vector<std::pair<int, double>> drivers_;   // what turns this joint, and by how much
  std::vector<std::pair<int, Vector6d>> driven_;  // what it turns
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("reduction_ratio", {make<ReductionRatio>,
                                            joint_owners,
                                            {.phrase = "a wrong reduction ratio",
                                             .place = Place::kJoint,
                                             .depends_on = {"q{n}"},
                                             .shown_by = kShownByMotion,
                                             .refers_to = Reference::kAxes,
                                             .plotted_over = "q{n}"}})

}  // namespace fastcal
