// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Tracker range: the instrument's lengths from itself are off,  measured r' = (1 + scale) r + offset,  the instrument
// at the origin of its station's measuring frame. The tool moves along its direction u; at equilibrium the state's tool
// is the measured one, hence
//   xi = R^T u (scale r' + offset) / (1 + scale).
// The scale is measurement_scale's: only lengths that are known show it. The offset shows wherever lengths vary in
// direction. Source: ASME B89.4.19-2006 (ranging tests of laser trackers).
#include "fastcal/effects/sight.hpp"
#include "fastcal/effects/stations.hpp"

namespace fastcal {
namespace {

class TrackerRange : public Effect {
 public:
  TrackerRange(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())), stations_(station_count("tracker_range", options)) {
    check_owner("tracker_range", owner, "instrument");
    check_options("tracker_range", options, {"count"});
    for (int k = 0; k < stations_; ++k) {
      parameters_.push_back({owner, station_prefix(k) + "offset", "m", 1e-4, "added to each length"});
      parameters_.push_back({owner, station_prefix(k) + "scale", "1", 1e-5, "relative error of each length"});
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override {
    return stations_ > 1 ? std::vector<std::string>{"station"} : std::vector<std::string>{};
  }

  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const override {
    const Pose& tool = state.frames[frame_];
    const double length = tool.p.norm();
    if (length == 0) return;
    const int first = stations_ > 1 ? 2 * state.station : 0;
    const double offset = theta[first];
    const double scale = theta[first + 1];
    Vector6d outward = Vector6d::Zero();
    outward.head<3>() = tool.R.transpose() * tool.p / length;
    xi.col(frame_) += (scale * length + offset) / (1 + scale) * outward;
    if (columns == nullptr) return;
    columns->push_back({first, frame_, outward / (1 + scale)});
    columns->push_back({first + 1, frame_, (length - offset) / ((1 + scale) * (1 + scale)) * outward});
  }

 private:
  int frame_;
  int stations_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("tracker_range", {make<TrackerRange>,
                                          single_owner("instrument"),
                                          {.phrase = "an error of the lengths that it measures",
                                           .role = Role::kOnRequest,
                                           .place = Place::kInstrument,
                                           .depends_on = {"x", "y", "z"},
                                           .shown_by = "poses that fill a wide angle as the instrument sees them",
                                           .refers_to = Reference::kAxes,
                                           .of_the_measurement = true,
                                           .labels = "stations"}})

}  // namespace fastcal
