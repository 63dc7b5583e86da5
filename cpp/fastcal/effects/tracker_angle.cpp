// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Tracker angles: the graduated circles of the instrument sit off their axes, so that azimuth a and elevation e of a
// point are read wrong by
//   da = a_s sin a + a_c cos a,   de = e_s sin e + e_c cos e   [rad].
// The instrument stands at the origin of its station's measuring frame, its vertical axis along z; with r, u the length
// and direction of the point p, v the level part of p:   dp = da z x v + de r du/de.
// Source: R. Loser, S. Kyle, "Alignment and field check procedures for the Leica Laser Tracker LTD 500" (1999).
#include "fastcal/effects/sight.hpp"
#include "fastcal/effects/stations.hpp"

namespace fastcal {
namespace {

class TrackerAngle : public LinearEffect {
 public:
  TrackerAngle(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())), stations_(station_count("tracker_angle", options)) {
    check_owner("tracker_angle", owner, "instrument");
    check_options("tracker_angle", options, {"count"});
    for (int k = 0; k < stations_; ++k) {
      for (const char* name : {"azimuth_sine", "azimuth_cosine", "elevation_sine", "elevation_cosine"})
        parameters_.push_back({owner, station_prefix(k) + name, "rad", 1e-5, "error of the circle's reading"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override {
    return stations_ > 1 ? std::vector<std::string>{"station"} : std::vector<std::string>{};
  }

  void basis(const State& state, TwistColumns& columns) const override {
    const Pose& tool = state.frames[frame_];
    const Sight sight(tool.p);
    if (sight.level == 0) return;
    const int first = stations_ > 1 ? 4 * state.station : 0;
    const auto push = [&](int k, double size, const Eigen::Vector3d& way) {
      Vector6d xi = Vector6d::Zero();
      xi.head<3>() = tool.R.transpose() * (size * way);
      columns.push_back({first + k, frame_, xi});
    };
    push(0, sight.forward.y(), sight.around());
    push(1, sight.forward.x(), sight.around());
    push(2, tool.p.z() / sight.range, sight.up());
    push(3, sight.level / sight.range, sight.up());
  }

 private:
  int frame_;
  int stations_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("tracker_angle", {make<TrackerAngle>,
                                          single_owner("instrument"),
                                          {.phrase = "eccentric angle circles",
                                           .role = Role::kOnRequest,
                                           .place = Place::kInstrument,
                                           .depends_on = {"x", "y", "z"},
                                           .shown_by = "poses that fill a wide angle as the instrument sees them",
                                           .refers_to = Reference::kAxes,
                                           .of_the_measurement = true,
                                           .labels = "stations"}})

}  // namespace fastcal
