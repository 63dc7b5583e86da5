// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Beam gravity: the arm as a frame of beams bends under its own weight and its payload, and each node of the frame that
// the robot file ties to the chain moves its link:
//   xi_f = sum_g scale_g d xi_f / d scale_g,   K(scale) u = f,
// scale_g [1] multiplies the compliance of a group of elements: 0 is rigid, 1 the beams of the robot file, 1 / scale_g
// the factor on their stiffness. One scale for all, or with `by: group` one a group. The derivatives hold at the last
// settle(), and the sum is exact there (robot/arm_bending.hpp).
// Source: "Kinematic Calibration Method for Large-Sized 7-DoF Hybrid Spray-Painting Robots" (2022), section 5, whose
// deflection is that of node 9 alone.
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/robot/arm_bending.hpp"

namespace fastcal {
namespace {

class BeamGravity : public LinearEffect {
 public:
  BeamGravity(const RobotModel& robot, const std::string& owner, const Options& options)
      : bending_(robot.description().bending) {
    check_owner("beam_gravity", owner, "structure");
    check_options("beam_gravity", options, {"by"});
    FASTCAL_CHECK(bending_ != nullptr) << "beam_gravity needs a structure in the robot file";
    const std::string by = text_option(options, "by", "structure");
    FASTCAL_CHECK(by == "structure" || by == "group") << "beam_gravity: by is structure or group, got '" << by << "'";
    const std::string doc = "factor on the beams' compliance: 0 rigid, 1 as in the robot file";
    const double infinite = std::numeric_limits<double>::infinity();
    if (by == "structure") {
      parameters_.push_back({owner, "scale", "1", 0.5, doc, 0, infinite, 1});
    } else {
      for (const std::string& group : bending_->groups()) {
        std::string name = "scale_", own = doc;
        name += group;
        own += ", of the group ";
        own += group;
        parameters_.push_back({owner, name, "1", 0.5, own, 0, infinite, 1});
      }
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames | kLoads | kBending; }

  void add_beam_scale(const double* theta, Eigen::VectorXd& scale) const override {
    for (int g = 0; g < scale.size(); ++g) scale[g] += theta[parameter(g)];
  }

  void basis(const State& state, TwistColumns& columns) const override {
    FASTCAL_CHECK(state.bending != nullptr) << "beam_gravity reads what settle() makes of the beams";
    const double* at = state.bending;
    for (const int frame : bending_->frames()) {
      for (int g = 0; g < static_cast<int>(bending_->groups().size()); ++g, at += 6)
        columns.push_back({parameter(g), frame, Eigen::Map<const Vector6d>(at)});
    }
  }

 private:
  /// Which parameter scales a group.
  int parameter(int group) const { return parameters_.size() == 1 ? 0 : group; }

  std::shared_ptr<const ArmBending> bending_;
  std::vector<Parameter> parameters_;
};

std::vector<std::string> structure_owners(const RobotModel& robot) {
  if (robot.description().bending == nullptr) return {};
  return {"structure"};
}

}  // namespace

FASTCAL_REGISTER_EFFECT("beam_gravity", {make<BeamGravity>,
                                         structure_owners,
                                         {.phrase = "sag of its structure under gravity",
                                          .place = Place::kStructure,
                                          .depends_on = {"load"},
                                          .needs_data = "a structure in the robot file",
                                          .shown_by = kShownByLoads}})

}  // namespace fastcal
