// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Coupling ratio: joint i also turns by h when joint j turns behind its gear,  q_i += h k_j q_j^n,  k_j q_j^n the
// output of joint j with its identified reduction ratio. h adds to the nominal coupling c_ij of the robot file. Source:
// SIASUN SR210D paper, equations 13 to 15, mended as docs/effects/reduction_ratio.md says.
#include <tuple>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class CouplingRatio : public LinearEffect {
 public:
  CouplingRatio(const RobotModel& robot, const std::string& owner, const Options& options)
      : types_(robot.description().joint_types),
        parameters_{{owner, "ratio", "1", 1e-3,
                     "turn of the driven joint per turn of its source, beyond the nominal coupling"}} {
    check_options("coupling_ratio", options, {});
    std::tie(driven_, source_) = joint_pair("coupling_ratio", owner, robot.joint_count());
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kOutput; }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, joint_frame(driven_), joint_motion(types_, driven_, state.output[source_])});
  }

  bool add_basis(const Samples& samples, Eigen::Index begin, int rows, TwistTable& table) const override {
    double* out = table.part(0, joint_frame(driven_), joint_part(types_, driven_));
    for (int i = 0; i < rows; ++i) out[i] += samples.output(begin + i, source_);
    return true;
  }

 private:
  int driven_ = 0;
  int source_ = 0;
  std::vector<JointType> types_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("coupling_ratio", {make<CouplingRatio>,
                                           joint_pair_owners,
                                           {.phrase = "a wrong coupling ratio",
                                            .place = Place::kJoint,
                                            .depends_on = {"q{m}"},
                                            .shown_by = "poses in which joint{m} moves further",
                                            .refers_to = Reference::kAxes,
                                            .plotted_over = "q{m}"}})

}  // namespace fastcal
