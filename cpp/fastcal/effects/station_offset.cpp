// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Station offset: from every set-up of the instrument the base appears a little elsewhere,  xi = offset of the row's
// station; the first station defines the measuring frame. Along and about the measuring frame's axes, through the
// base's origin. Option `count`: how many stations there are, the first included; State::station counts from 0.
#include "fastcal/effects/owners.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

class StationOffset : public LinearEffect {
 public:
  StationOffset(const RobotModel&, const std::string& owner, const Options& options) {
    check_owner("station_offset", owner, "base");
    check_options("station_offset", options, {"count"});
    const double count = number_option(options, "count", 2);
    FASTCAL_CHECK(count >= 2) << "station_offset needs at least two stations, got " << count;
    for (int station = 2; station <= static_cast<int>(count); ++station) {
      for (int axis = 0; axis < 6; ++axis) {
        parameters_.push_back({owner, "station" + std::to_string(station) + "_" + kAxes[axis], axis < 3 ? "m" : "rad",
                               1e-4, "where this station sees the base, against the first"});
      }
    }
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }
  std::vector<std::string> data_columns() const override { return {"station"}; }

  void basis(const State& state, TwistColumns& columns) const override {
    if (state.station < 1) return;
    for (int axis = 0; axis < 6; ++axis)
      columns.push_back({6 * (state.station - 1) + axis, kBaseFrame, base_motion(state, axis, 1)});
  }

 private:
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("station_offset", {make<StationOffset>,
                                           single_owner("base"),
                                           {.phrase = "an offset between stations of the instrument",
                                            .place = Place::kBase,
                                            .depends_on = {"station"},
                                            .needs_data = "two stations or more in the column station",
                                            .shown_by = "poses that are measured from each station",
                                            .refers_to = Reference::kBase,
                                            .of_the_measurement = true,
                                            .plotted_over = "station",
                                            .options_from_data = {"stations"},
                                            .labels = "stations"}})

}  // namespace fastcal
