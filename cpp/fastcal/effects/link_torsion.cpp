// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Link torsion: the far end of the link turns about the link's own axis e by phi = (M . e) L / GJ, M [N m] the moment
// about that end of all that hangs beyond it. The link's own weight lies on the axis and twists nothing. Parameter: 1 /
// GJ [1/(N m^2)]. Source: S. Timoshenko, "Strength of Materials", part I (1955), chapter X.
#include "fastcal/effects/arm_size.hpp"
#include "fastcal/effects/beam.hpp"
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class LinkTorsion : public LinearEffect {
 public:
  LinkTorsion(const RobotModel& robot, const std::string& owner, const Options& options)
      : link_(owner_index("link_torsion", "link", owner, robot.joint_count())),
        beam_("link_torsion", robot, link_, options),
        parameters_{{owner, "inverse_gj", "1_nm2", 3 * plausible_bending(robot),
                     "1 / (shear modulus times torsion constant)", 0}} {
    check_options("link_torsion", options, {Beam::kOption});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kLoads; }
  std::map<std::string, ListOption> reference() const override { return beam_.reference(); }

  void basis(const State& state, TwistColumns& columns) const override {
    const Eigen::Map<const Eigen::Vector3d> M(state.load + 6 * link_frame(link_) + 3);
    Vector6d xi = Vector6d::Zero();
    xi.tail<3>() = beam_.axis() * (beam_.axis().dot(M) * beam_.length());
    columns.push_back({0, link_frame(link_), xi});
  }

 private:
  int link_;
  Beam beam_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("link_torsion", {make<LinkTorsion>,
                                         long_link_owners,
                                         {.phrase = "a link that twists",
                                          .place = Place::kLink,
                                          .depends_on = {"load"},
                                          .shown_by = kShownByLoads,
                                          .options_from_data = {"reference"}}})

}  // namespace fastcal
