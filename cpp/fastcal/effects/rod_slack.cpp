// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Slack in the balls of a rod: a rod bears a pull F [N] alone, so that both balls lie against their sockets along it,
//   d length = gap/2 F / (F^2 + F_0^2)^(1/2),
// gap [m] the play of both balls together. Below F_0 = 1 N it floats.
#include <cmath>

#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

constexpr double kSize = 2e-4;   // [m] worn sockets
constexpr double kFloats = 1.0;  // [N]

class RodSlack : public LinearEffect {
 public:
  RodSlack(const RobotModel& robot, const std::string& owner, const Options& options)
      : rod_(rod_index("rod_slack", owner, robot)),
        parameters_{{owner, "gap", "m", kSize, "play of both balls along the rod", 0}} {
    check_options("rod_slack", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }

  void basis(const State& state, TwistColumns& columns) const override {
    const double pull = state.load[6 * rod_ + kAlongRod];
    columns.push_back({0, rod_, Vector6d::Unit(kAlongRod) * (pull / (2 * std::hypot(pull, kFloats)))});
  }

 private:
  int rod_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("rod_slack",
                        {make<RodSlack>,
                         rod_owners,
                         {.phrase = "slack in the balls of a rod",
                          .place = Place::kLoop,
                          .depends_on = {"load"},
                          .needs_data = "masses in the robot file, or payloads",
                          .shown_by = "poses and payloads in which the rod goes from tension to compression",
                          .number = "gap"}})

}  // namespace fastcal
