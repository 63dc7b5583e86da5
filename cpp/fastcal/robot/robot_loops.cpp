// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The loops of a robot: their constants as parameters, and which of their equations are kept.
#include <cmath>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/robot/assembly.hpp"
#include "fastcal/robot/robot_model.hpp"

namespace fastcal {
namespace {

constexpr double kSigma = 1e-3;  // [m], [rad], [1]: plausible errors of what is machined
constexpr const char* kAxes[3] = {"x", "y", "z"};

}  // namespace

void RobotModel::add_number(double value, Parameter parameter) {
  FASTCAL_CHECK(std::isfinite(value)) << parameter.owner << " " << parameter.name << " must be a finite number, got "
                                      << value;
  parameters_.push_back(std::move(parameter));
  nominal_.conservativeResize(nominal_.size() + 1);
  nominal_[nominal_.size() - 1] = value;
}

void RobotModel::add_loop_parameters() {
  const auto pin = [this](const Loop& loop, const Pose& pose, const std::string& end) {
    for (int k = 0; k < 3; ++k)
      add_number(pose.p[k],
                 {loop.name, end + "_" + kAxes[k], "m", kSigma,
                  std::string("place ") + kAxes[k] + " of its pin in the frame that it begins (from) or ends (to) at"});
  };
  for (Loop& loop : description_.loops) {
    loop.first_parameter = static_cast<int>(parameters_.size());
    if (loop.kind == Loop::Kind::kGear) {
      for (const auto& [joint, ratio] : loop.joints)
        add_number(ratio, {loop.name, "ratio_joint" + std::to_string(joint + 1), "1", kSigma,
                           "turn of the driven joint per turn of this one"});
      const bool slides = description_.joint_types[static_cast<std::size_t>(loop.driven)] == JointType::kPrismatic;
      add_number(loop.length,
                 {loop.name, "offset", slides ? "m" : "rad", kSigma, "where the driven joint is at 0 of the others"});
      continue;
    }
    if (loop.knows_from) pin(loop, loop.from, "from");
    if (loop.knows_to) pin(loop, loop.to, "to");
    if (loop.kind == Loop::Kind::kRod)
      add_number(loop.length, {loop.name, "length", "m", kSigma, "distance of its pins"});
    for (int k = 0; loop.turns() && k < 3; ++k)
      add_number(0, {loop.name, std::string("r") + kAxes[k], "rad", kSigma,
                     std::string("turn of its first pin about its own ") + kAxes[k]});
  }
}

Loop RobotModel::loop_at(const Loop& loop, const Eigen::Ref<const Eigen::VectorXd>& values) const {
  Loop out = loop;
  int at = loop.first_parameter;
  if (loop.kind == Loop::Kind::kGear) {
    for (auto& [joint, ratio] : out.joints) ratio = values[at++];
    out.length = values[at];
    return out;
  }
  if (loop.knows_from) out.from.p = values.segment<3>(std::exchange(at, at + 3));
  if (loop.knows_to) out.to.p = values.segment<3>(std::exchange(at, at + 3));
  if (loop.kind == Loop::Kind::kRod) out.length = values[at];
  if (loop.turns()) {
    out.turn = values.segment<3>(at);
    out.from.R = loop.from.R * Eigen::AngleAxisd(out.turn[0], Eigen::Vector3d::UnitX()) *
                 Eigen::AngleAxisd(out.turn[1], Eigen::Vector3d::UnitY()) *
                 Eigen::AngleAxisd(out.turn[2], Eigen::Vector3d::UnitZ());
  }
  return out;
}

void RobotModel::close_loops() {
  if (description_.loops.empty() && description_.passive.empty()) return;
  FASTCAL_CHECK(!description_.passive.empty())
      << "the robot has loops and no passive joint: mark the joints that no motor moves";
  if (description_.home.size() == 0) description_.home = Eigen::VectorXd::Zero(joint_count());
  Chain whole = chain();
  choose_loop_rows(whole);
  loop_rows_ = whole.loop_rows;
  description_.home = whole.home;
}

}  // namespace fastcal
