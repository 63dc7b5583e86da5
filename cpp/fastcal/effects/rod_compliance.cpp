// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The stiffness of a rod between two balls, its joints included: its pull F [N] (virtual work, loop_loads.cpp) makes it
// longer,
//   d length = c F,  c >= 0 in m/N; of a bar of one section c = length / (E A).
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class RodCompliance : public LinearEffect {
 public:
  RodCompliance(const RobotModel& robot, const std::string& owner, const Options& options)
      : rod_(rod_index("rod_compliance", owner, robot)),
        parameters_{{owner, "compliance", "m_n", plausible_compliance(robot, JointType::kPrismatic),
                     "how much longer its pull makes the rod, per force", 0}} {
    check_options("rod_compliance", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  void basis(const State& state, TwistColumns& columns) const override {
    columns.push_back({0, rod_, Vector6d::Unit(kAlongRod) * state.load[6 * rod_ + kAlongRod]});
  }

 private:
  int rod_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("rod_compliance",
                        {make<RodCompliance>,
                         rod_owners,
                         {.phrase = "a rod that yields (compliance)",
                          .place = Place::kLoop,
                          .depends_on = {"load"},
                          .needs_data = "masses in the robot file, or payloads",
                          .shown_by = "poses and payloads in which the force in the rod varies in size"}})

}  // namespace fastcal
