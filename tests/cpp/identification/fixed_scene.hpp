// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A disturbed arm and data that fix each of its free parameters.
#pragma once

#include "fastcal/identification/identifiability.hpp"
#include "fastcal/identification/solver.hpp"
#include "fastcal/identification/whitened_rows.hpp"
#include "support/simulation.hpp"

namespace fastcal::test {

/// A disturbed arm, its data, and parameters that the data fix.
struct Fixed {
  ErrorModel model;
  Samples samples;
  Measured measured;
  std::vector<int> free;
  Eigen::VectorXd scale;
  Eigen::VectorXd truth;

  Problem problem(int threads = 1) const { return {model, samples, measured, threads}; }
};

inline Fixed fixed(std::uint64_t seed, What what, Eigen::Index rows, double error = 5e-4) {
  Random random(seed);
  Fixed out{ErrorModel(build("dh", six_axes(0.7))), postures(random, rows, 6), {}, {}, {}, {}};
  out.truth = disturbed(random, out.model, error);
  out.measured = measure(random, out.model, out.samples, out.truth, what, {5e-5, 5e-5});
  const Problem problem = out.problem();
  const std::vector<int> all = asked(out.model, what);
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(all.size()), 1e-3);
  Eigen::VectorXd hold(scale.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    hold[static_cast<Eigen::Index>(k)] = fixing_priority(out.model.parameters()[static_cast<std::size_t>(all[k])]);
  const Gauge gauge =
      choose_gauge(triangular_factor(problem, out.model.start(), all, scale, {{1e-4, 1e-4, 1e-4}}), hold);
  for (const int k : gauge.free) out.free.push_back(all[static_cast<std::size_t>(k)]);
  out.scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(out.free.size()), 1e-3);
  return out;
}

inline const CommonNoise kTau{1e-4, 2e-4, 3e-4};

inline Eigen::VectorXd moved(const Fixed& s, const Eigen::VectorXd& x) {
  Eigen::VectorXd theta = s.model.start();
  for (std::size_t k = 0; k < s.free.size(); ++k)
    theta[s.free[k]] += s.scale[static_cast<Eigen::Index>(k)] * x[static_cast<Eigen::Index>(k)];
  return theta;
}

}  // namespace fastcal::test
