// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Surrogate: what remains at a place without a name for its cause, as the mean of a Gaussian process of what the place
// depends on. With the inputs x (surrogate_inputs.hpp), directions d of the place's motion and nodes x_k,
//   motion along d = amount w(x) sum_k weight_kd exp(-|(x - x_k) / width|^2 / 2),
// and with it the geometry moves by  amount w(x) shift,  so that both together are orthogonal to what the geometry can
// do by itself (M. Plumlee, "Bayesian calibration of inexact computer models", 2017): the geometry's numbers stay what
// they are without the surrogate. The window w is 1 between `low` and `high` and falls to 0 within one width beyond.
// Places and directions: jointN (its own motion), base and workspace (along and about, along the measuring axes), tool
// and linkN (along and about their own axes), robot (growth of all lengths), instrument (azimuth, elevation, range).
// Options: inputs, low, high, width, nodes (k inputs), weights (k directions), shift (all parameters of the robot).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fastcal/effects/growth.hpp"
#include "fastcal/effects/sight.hpp"
#include "fastcal/effects/surrogate_inputs.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {
namespace {

std::vector<std::string> places(const RobotModel& robot) {
  std::vector<std::string> out = frame_owners(robot);
  out.insert(out.end(), {"robot", "instrument", "workspace"});
  return out;
}

class Surrogate : public LinearEffect {
 public:
  Surrogate(const RobotModel& robot, const std::string& owner, const Options& options)
      : owner_(owner),
        joint_count_(robot.joint_count()),
        types_(robot.description().joint_types),
        parameters_{{owner, "amount", "1", 1, "share of the function that is applied"}},
        names_(text_option(options, "inputs", "")),
        inputs_(surrogate_inputs(names_, robot)),
        low_(list_option(options, "low")),
        high_(list_option(options, "high")),
        width_(list_option(options, "width")),
        nodes_(list_option(options, "nodes")),
        weights_(list_option(options, "weights")),
        shift_(list_option(options, "shift")) {
    check_options("surrogate", options, {"inputs", "low", "high", "width", "nodes", "weights", "shift"});
    const std::vector<std::string> known = places(robot);
    if (std::find(known.begin(), known.end(), owner) == known.end()) frame_index("surrogate", owner, robot);
    const bool one = owner.rfind("joint", 0) == 0 || owner == "robot";
    directions_ = one ? 1 : owner == "instrument" || owner == "workspace" ? 3 : 6;
    frame_ = owner == "instrument"                      ? tool_frame(joint_count_)
             : owner == "robot" || owner == "workspace" ? kBaseFrame
                                                        : frame_index("surrogate", owner, robot);
    for (const auto* sizes : {&low_, &high_, &width_})
      FASTCAL_CHECK(sizes->size() == inputs_.size())
          << "surrogate: low, high and width need a number for each of the inputs '" << names_ << "'";
    FASTCAL_CHECK(std::all_of(width_.begin(), width_.end(), [](double w) { return w > 0; }))
        << "surrogate: a width must be above 0";
    count_ = weights_.size() / directions_;
    FASTCAL_CHECK(weights_.size() == count_ * directions_ && nodes_.size() == count_ * inputs_.size())
        << "surrogate: expected " << inputs_.size() << " numbers a node and " << directions_ << " weights each, got "
        << nodes_.size() << " and " << weights_.size();
    FASTCAL_CHECK(shift_.empty() || shift_.size() == robot.parameters().size())
        << "surrogate: shift must have " << robot.parameters().size() << " numbers, got " << shift_.size();
  }

  const std::vector<Parameter>& parameters() const override { return parameters_; }

  unsigned needs() const override {
    unsigned out = kFrames;
    for (const SurrogateInput& input : inputs_) out |= input.needs;
    return out;
  }

  bool follows_loads() const override { return false; }  // a load among its inputs makes it no compliance

  std::vector<std::string> data_columns() const override {
    std::vector<std::string> out;
    for (const SurrogateInput& input : inputs_) {
      if (!input.column.empty()) out.push_back(input.column);
    }
    return out;
  }

  void basis(const State& state, TwistColumns& columns) const override {
    Eigen::VectorXd x(static_cast<Eigen::Index>(inputs_.size()));
    double window = 1;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const double value = x[static_cast<Eigen::Index>(i)] = inputs_[i].value(state);
      const double beyond = std::max({low_[i] - value, value - high_[i], 0.0}) / width_[i];
      window *= (1 + std::cos(std::numbers::pi * std::min(beyond, 1.0))) / 2;
    }
    if (window == 0) return;
    Eigen::VectorXd size = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(directions_));
    for (std::size_t k = 0; k < count_; ++k) {
      double square = 0;
      for (std::size_t i = 0; i < inputs_.size(); ++i) {
        const double off = (x[static_cast<Eigen::Index>(i)] - nodes_[k * inputs_.size() + i]) / width_[i];
        square += off * off;
      }
      size += window * std::exp(-square / 2) *
              Eigen::Map<const Eigen::VectorXd>(weights_.data() + k * directions_, size.size());
    }
    move(state, size, columns);
    for (const Chain::Column& column : state.chain->columns) {
      const double by = shift_.empty() ? 0 : window * shift_[static_cast<std::size_t>(column.parameter)];
      if (by == 0) continue;
      if (column.frame != kWorldFrame) {
        columns.push_back({0, column.frame, by * column.xi});
      } else {
        columns.push_back({0, kBaseFrame, by * adjoint(state.chain->constants[kBaseFrame].inverse()) * column.xi});
      }
    }
  }

 private:
  void move(const State& state, const Eigen::VectorXd& size, TwistColumns& columns) const {
    if (owner_ == "robot") {
      for (int f = kBaseFrame + 1; f < tool_frame(joint_count_); ++f)
        columns.push_back({0, f, size[0] * growth(state, f)});
      return;
    }
    Vector6d xi = Vector6d::Zero();
    if (owner_ == "instrument") {
      const Pose& tool = state.frames[frame_];
      const Sight sight(tool.p);
      xi.head<3>() = tool.R.transpose() * (size[0] * sight.around() + size[1] * sight.up() + size[2] * sight.outward());
    } else if (directions_ == 1) {
      xi = joint_motion(types_, frame_ / 2, size[0]);
    } else if (frame_ == kBaseFrame) {
      for (Eigen::Index axis = 0; axis < size.size(); ++axis)
        xi += base_motion(state, static_cast<int>(axis), size[axis]);
    } else {
      xi = size;
    }
    columns.push_back({0, frame_, xi});
  }

  std::string owner_;
  int joint_count_;
  std::vector<JointType> types_;
  std::vector<Parameter> parameters_;
  std::string names_;
  std::vector<SurrogateInput> inputs_;
  std::vector<double> low_, high_, width_, nodes_, weights_, shift_;
  std::size_t directions_ = 1, count_ = 0;
  int frame_ = 0;
};

}  // namespace

FASTCAL_REGISTER_EFFECT("surrogate", {make<Surrogate>,
                                      places,
                                      {.phrase = "an unexplained error",
                                       .role = Role::kCurve,
                                       .place = Place::kAnywhere,
                                       .depends_on = {"inputs"},
                                       .shown_by = "poses in which its inputs vary"}})

}  // namespace fastcal
