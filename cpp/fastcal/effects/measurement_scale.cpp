// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Measurement scale: the instrument's lengths are wrong,  measured = (1 + error) true,  about the instrument's origin.
// The tool's frame moves by R^T p e,  p the true place. At equilibrium the state's tool is the measured one, p (1 + e),
// hence
//   xi = R^T p_state e / (1 + e).
// Only lengths that are known show it: of an arm whose lengths are all identified, it is that arm grown by e.
#include "fastcal/effects/owners.hpp"

namespace fastcal {
namespace {

class MeasurementScale : public Effect {
 public:
  MeasurementScale(const RobotModel& robot, const std::string& owner, const Options& options)
      : frame_(tool_frame(robot.joint_count())),
        parameters_{{owner, "error", "1", 1e-5, "relative error of the measured lengths"}} {
    check_owner("measurement_scale", owner, "instrument");
    check_options("measurement_scale", options, {});
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  unsigned needs() const override { return kFrames; }

  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const override {
    const double error = theta[0];
    const Pose& tool = state.frames[frame_];
    Vector6d outward = Vector6d::Zero();
    outward.head<3>() = tool.R.transpose() * tool.p;
    xi.col(frame_) += error / (1 + error) * outward;
    if (columns != nullptr) columns->push_back({0, frame_, outward / ((1 + error) * (1 + error))});
  }

 private:
  int frame_;
  std::vector<Parameter> parameters_;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("measurement_scale",
                        {make<MeasurementScale>,
                         single_owner("instrument"),
                         {.phrase = "a wrong scale of the instrument",
                          .place = Place::kInstrument,
                          .depends_on = {"x", "y", "z"},
                          .shown_by = "a known length, such as a scale bar: the lengths of the geometry take it up",
                          .refers_to = Reference::kAxes,
                          .of_the_measurement = true}})

}  // namespace fastcal
