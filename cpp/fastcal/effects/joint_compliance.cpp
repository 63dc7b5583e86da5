// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Linear joint compliance: the joint turns along its load,  dq_i = c_i tau_i,  tau_i the torque [N m] about its axis of
// all weights and wrenches beyond it (prismatic: the force [N] along it), c_i >= 0 in rad/(N m) (m/N). Source: KUKA
// KR500 paper, equations 11 to 14 (its "external force" is this torque), tau in the deflected posture. With `sign:
// against` dq_i = -c_i tau_i: what a controller leaves that compensates for more deflection than there is.
#include "fastcal/effects/against_load.hpp"
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class JointCompliance : public LinearEffect {
 public:
  JointCompliance(const RobotModel& robot, const std::string& owner, const Options& options)
      : joint_(owner_index("joint_compliance", "joint", owner, robot.joint_count())),
        types_(robot.description().joint_types),
        type_(types_[static_cast<std::size_t>(joint_)]),
        sign_(sign_option("joint_compliance", options)),
        parameters_{{owner, sign_ > 0 ? "compliance" : "excess_compliance",
                     type_ == JointType::kRevolute ? "rad_nm" : "m_n", plausible_compliance(robot, type_),
                     "turn per torque about the joint's axis", 0}} {
    check_options("joint_compliance", options, {kSignOption});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }
  bool is_spring() const override { return true; }
  double joint_compliance(const State&, int joint, const double* theta) const override {
    return joint == joint_ ? sign_ * theta[0] : 0;
  }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back(
        {0, joint_frame(joint_), joint_motion(types_, joint_, sign_ * state.joint_load(state.load, joint_, type_))});
  }

  bool add_basis(const Samples& samples, Eigen::Index begin, int rows, TwistTable& table) const override {
    const int part = joint_part(types_, joint_);
    double* out = table.part(0, joint_frame(joint_), part);
    for (int i = 0; i < rows; ++i) out[i] += sign_ * samples.load(begin + i, 6 * joint_frame(joint_) + part);
    return true;
  }

 private:
  int joint_;
  std::vector<JointType> types_;
  JointType type_;
  double sign_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("joint_compliance", {make<JointCompliance>,
                                             joint_owners,
                                             {.phrase = "compliance (deflection under load)",
                                              .place = Place::kJoint,
                                              .depends_on = {"torque"},
                                              .shown_by = kShownByLoads,
                                              .refers_to = Reference::kAxes,
                                              .plotted_over = "torque",
                                              .forms = {kAgainstLoad}}})

}  // namespace fastcal
