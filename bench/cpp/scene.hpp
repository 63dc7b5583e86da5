// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What all benchmarks look at: a 6R arm of 2 m reach, random postures, points with 50 um of noise.
#pragma once

#include "support/simulation.hpp"

namespace fastcal::bench {

struct Scene {
  ErrorModel model;
  Samples samples;
  test::Measured measured;
  std::vector<int> asked;

  Problem problem() const { return {model, samples, measured, 1}; }
};

inline Scene scene(Eigen::Index rows) {
  test::Random random(1);
  Scene out{ErrorModel(test::build("dh", test::six_axes())), test::postures(random, rows, 6), {}, {}};
  const Eigen::VectorXd truth = test::disturbed(random, out.model, 3e-4);
  out.measured = test::measure(random, out.model, out.samples, truth, test::What::kPositions, {5e-5, 0});
  out.asked = test::asked(out.model, test::What::kPositions);
  return out;
}

}  // namespace fastcal::bench
