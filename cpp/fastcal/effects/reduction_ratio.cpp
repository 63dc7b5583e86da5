// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Reduction ratio: joint j turns by k_j times what its motor's position says, error = k_j - 1. With nominal coupling c,
//   q_j += error (q_j - sum_m c_jm q_m),   q_i += c_ij error q_j   for every joint i that j drives.
// Source: SIASUN SR210D paper, equations 13 to 15, mended as docs/effects/reduction_ratio.md says.
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class ReductionRatio : public LinearEffect {
 public:
  ReductionRatio(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("reduction_ratio", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        coupling_(robot.description().coupling),
        parameters_{{owner, "error", "1", 1e-3, "relative error of the reduction ratio, k - 1"}} {
    check_options("reduction_ratio", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  double output_error(int joint, const double* theta) const override { return joint == joint_ ? theta[0] : 0; }

  void basis(const State& state, TwistColumns& columns) const override {
    double own = state.q[joint_];
    for (int m = 0; m < static_cast<int>(types_.size()); ++m) own -= coupling_(joint_, m) * state.q[m];
    columns.push_back({0, joint_frame(joint_), joint_motion(types_, joint_, own)});
    for (int i = 0; i < static_cast<int>(types_.size()); ++i) {
      if (coupling_(i, joint_) != 0)
        columns.push_back({0, joint_frame(i), joint_motion(types_, i, coupling_(i, joint_) * state.q[joint_])});
    }
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  Eigen::MatrixXd coupling_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("reduction_ratio", {make<ReductionRatio>, joint_owners})

}  // namespace fastcal
