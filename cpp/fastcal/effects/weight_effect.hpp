// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What weights that are not as the robot file says have in common. They move nothing themselves: they change the loads,
// and the arm's compliances answer. All loads hold them since the last settle() (add_weights), where theta was theta_s;
// what theta has moved since acts to first order through the joints:
//   dq_j = C_j (d tau_j / d theta) (theta - theta_s),  C_j = d q_j / d tau_j of all compliances of joint j, tau_j its
//   load,
// which is 0 at the fixed point of the outer iterations and gives the solver its derivative.
#pragma once

#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {

inline std::vector<std::string> payload_owners(const RobotModel&) { return {"payload"}; }

inline void check_payload_owner(const std::string& effect, const std::string& owner) {
  FASTCAL_CHECK(owner == "payload") << effect << " is owned by the payload, got '" << owner << "'";
}

class WeightEffect : public Effect {
 public:
  explicit WeightEffect(const RobotModel& robot) : types_(robot.description().joint_types) {}

  unsigned needs() const override { return kFrames | kLoads | kCompliance; }
  bool is_weight() const override { return true; }

  /// Appends the columns of B: what each parameter moves.
  virtual void basis(const State& state, TwistColumns& columns) const = 0;

  /// The value of a parameter that the loads hold already.
  virtual double settled(const Weights& weights, int parameter) const = 0;

  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const final {
    if (columns == nullptr && is_settled(state, theta)) return;
    TwistColumns own;
    TwistColumns& to = columns != nullptr ? *columns : own;
    const std::size_t first = to.size();
    basis(state, to);
    for (std::size_t i = first; i < to.size(); ++i) {
      const int k = to[i].parameter;
      xi.col(to[i].frame) += (theta[k] - settled(*state.weights, k)) * to[i].xi;
    }
  }

 protected:
  /// Parameter `k` makes `mass` [kg] more with first moment `moment` [kg m] (axes of the measuring frame, about its
  /// origin) hang beyond joint `last` and all joints that carry it.
  void push_weight(const State& state, int last, int k, double mass, const Eigen::Vector3d& moment,
                   TwistColumns& columns) const {
    const Eigen::Map<const Eigen::Vector3d> gravity(state.gravity);
    for (int j = 0; j <= last; ++j) {
      if (!state.chain->tree->carries(joint_frame(j), joint_frame(last))) continue;  // of another branch
      const Pose& joint = state.frames[joint_frame(j)];
      const bool revolute = types_[static_cast<std::size_t>(j)] == JointType::kRevolute;
      const Eigen::Vector3d axis = joint.R.col(2);
      const double load = revolute ? axis.dot((moment - mass * joint.p).cross(gravity)) : mass * axis.dot(gravity);
      columns.push_back({k, joint_frame(j), joint_motion(types_, j, state.compliance[j] * load)});
    }
  }

  std::vector<JointType> types_;

 private:
  bool is_settled(const State& state, const double* theta) const {
    for (int k = 0; k < static_cast<int>(parameters().size()); ++k) {
      if (theta[k] != settled(*state.weights, k)) return false;
    }
    return true;
  }
};

}  // namespace fastcal
