// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What all benchmarks look at: a 6R arm of 2 m reach, random postures, points with 50 um of noise.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fastcal/effects/registry.hpp"
#include "support/simulation.hpp"

namespace fastcal::bench {

struct Scene {
  ErrorModel model;
  Samples samples;
  test::Measured measured;
  std::vector<int> asked;

  Problem problem() const { return {model, samples, measured, 1}; }
};

/// The arm, and with `ratios` an error of the reduction ratio of each joint.
inline ErrorModel arm(bool ratios) {
  const RobotModel robot = test::build("dh", test::six_axes());
  std::vector<std::shared_ptr<const Effect>> effects;
  for (int joint = 1; ratios && joint <= 6; ++joint)
    effects.push_back(make_effect("reduction_ratio", robot, "joint" + std::to_string(joint), {}));
  return ErrorModel(robot, effects, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(effects.size())));
}

/// `asked`: all parameters that points can show, in the model's order.
inline Scene scene(Eigen::Index rows, bool ratios = false) {
  test::Random random(1);
  Scene out{arm(ratios), test::postures(random, rows, 6), {}, {}};
  const Eigen::VectorXd truth = test::disturbed(random, out.model, 3e-4);
  out.measured = test::measure(random, out.model, out.samples, truth, test::What::kPositions, {5e-5, 0});
  out.asked = test::asked(arm(false), test::What::kPositions);
  for (int k = static_cast<int>(out.asked.size()) + 3; k < out.model.parameter_count(); ++k) out.asked.push_back(k);
  return out;
}

}  // namespace fastcal::bench
