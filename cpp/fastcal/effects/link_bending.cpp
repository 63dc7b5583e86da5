// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Link bending: the link is an Euler-Bernoulli cantilever along its own axis e, of length L (beam.hpp, nominal). Force
// F [N] and moment M [N m] of all that hangs beyond its far end, and its own weight spread evenly, w = m g / L, deflect
// and turn that end:
//   u = (F_t L^3 / 3 + (M x e) L^2 / 2 + w_t L^4 / 8) / EI,   phi = (e x F L^2 / 2 + M_t L + e x w L^3 / 6) / EI,   t:
//   across e.
// Both planes share one inverse bending stiffness 1 / EI [1/(N m^2)], since the links' sections are not in the robot
// file. Source: S. Timoshenko, "Strength of Materials", part I (1955), chapter V. With `sign: against` both are
// negated: what a controller leaves that compensates for more bending than there is.
#include <Eigen/Geometry>

#include "fastcal/effects/against_load.hpp"
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/beam.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class LinkBending : public LinearEffect {
 public:
  LinkBending(const RobotModel& robot, const std::string& owner, const Options& options)
      : link_(owner_index("link_bending", "link", owner, robot.joint_count())),
        beam_("link_bending", robot, link_, options),
        sign_(sign_option("link_bending", options)),
        parameters_{{owner, sign_ > 0 ? "inverse_ei" : "excess_inverse_ei", "1_nm2", plausible_bending(robot),
                     "1 / (Young's modulus times second moment of area)", 0}} {
    check_options("link_bending", options, {Beam::kOption, kSignOption});
    mass_ = robot.description().bodies[static_cast<std::size_t>(link_)].mass;
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames | kLoads; }
  std::map<std::string, ListOption> reference() const override { return beam_.reference(); }

  void basis(const State& state, TwistColumns& columns) const override {
    const double* load = state.load + 6 * link_frame(link_);
    const Eigen::Map<const Eigen::Vector3d> F(load), M(load + 3), gravity(state.gravity);
    const double mass = mass_ + state.weights->mass[link_];
    const Eigen::Vector3d W = mass * (state.frames[link_frame(link_)].R.transpose() * gravity);  // w L
    const double L = beam_.length();
    const Eigen::Vector3d& e = beam_.axis();
    Vector6d xi;
    xi.head<3>() = across(F) * (L * L * L / 3) + M.cross(e) * (L * L / 2) + across(W) * (L * L * L / 8);
    xi.tail<3>() = e.cross(F) * (L * L / 2) + across(M) * L + e.cross(W) * (L * L / 6);
    columns.push_back({0, link_frame(link_), sign_ * xi});
  }

 private:
  Eigen::Vector3d across(const Eigen::Vector3d& v) const { return v - beam_.axis().dot(v) * beam_.axis(); }

  int link_;
  Beam beam_;
  double sign_;
  std::vector<Parameter> parameters_;
  double mass_ = 0;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("link_bending", {make<LinkBending>,
                                         long_link_owners,
                                         {.phrase = "a link that bends",
                                          .place = Place::kLink,
                                          .depends_on = {"load"},
                                          .shown_by = kShownByLoads,
                                          .options_from_data = {"reference"},
                                          .forms = {kAgainstLoad}}})

}  // namespace fastcal
