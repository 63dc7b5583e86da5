// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/linearization.hpp"

#include <cmath>
#include <map>

#include "fastcal/math/check.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

/// d [v; w] / d theta (6, p) of the frames that some observation looks at.
class FrameJacobians {
 public:
  FrameJacobians(const Problem& problem, int parameter_count) {
    for (const PlacedObservation& of : problem.measured.observations()) {
      for (const int frame : of.frames)
        by_frame_.try_emplace(frame, Eigen::Matrix<double, 6, Eigen::Dynamic>(6, parameter_count));
    }
  }

  /// Brings them up to date; returns the poses of all frames.
  const std::vector<Pose>& evaluate(RowEvaluator& evaluator, const State& state) {
    const std::vector<Pose>& T = evaluator.columns(state);
    for (auto& [frame, J] : by_frame_) evaluator.motion(frame, J);
    return T;
  }

  const Eigen::Matrix<double, 6, Eigen::Dynamic>& of(int frame) const { return by_frame_.at(frame); }

 private:
  std::map<int, Eigen::Matrix<double, 6, Eigen::Dynamic>> by_frame_;
};

}  // namespace

Linearization linearize(const Problem& problem, const Eigen::VectorXd& theta, const CommonNoise& tau) {
  problem.check();
  FASTCAL_CHECK(theta.size() == problem.parameter_count())
      << "theta must hold " << problem.parameter_count() << " numbers, got " << theta.size();
  const int p = problem.model.parameter_count();
  Samples samples = problem.samples;
  settle(problem.model, theta.head(p), problem.threads, samples);
  const Eigen::VectorXd unknowns = theta.tail(problem.measured.unknown_count());

  const Eigen::Index most = problem.row_count() * problem.measured.number_count();
  Linearization out{RowMatrixXd::Zero(most, theta.size()), Eigen::VectorXd(most), Eigen::VectorXi(most),
                    Eigen::VectorXi(most)};
  RowEvaluator evaluator(problem.model, theta.head(p));
  FrameJacobians J(problem, p);
  Comparison comparison;
  Eigen::Index n = 0;
  for (Eigen::Index i = 0; i < problem.row_count(); ++i) {
    const std::vector<Pose>& T = J.evaluate(evaluator, samples.row(i));
    for (const PlacedObservation& of : problem.measured.observations()) {
      comparison.clear();
      of->compare(i, sights_of(of, [&](int frame) { return T[frame]; }), unknowns.data() + of.first_unknown,
                  comparison);
      for (int c = 0; c < of.component_count; ++c) {
        if (!comparison.present[c]) continue;
        const int number = of.first_number + c;
        const double sigma =
            std::hypot(problem.measured.sigma(i, number), tau[problem.measured.observation_of(number)]);
        FASTCAL_CHECK(sigma > 0) << "row " << i << " has a number without a standard deviation";
        for (std::size_t f = 0; f < of.frames.size(); ++f)
          out.J.row(n).head(p) += comparison.by_frame[f].row(c) * J.of(of.frames[f]) / sigma;
        out.J.row(n).segment(p + of.first_unknown + comparison.first_unknown, comparison.unknown_count) =
            comparison.by_unknown.row(c).head(comparison.unknown_count) / sigma;
        out.r[n] = comparison.r[c] / sigma;
        out.number[n] = number;
        out.row[n++] = static_cast<int>(i);
      }
    }
  }
  out.J.conservativeResize(n, Eigen::NoChange);
  out.r.conservativeResize(n);
  out.row.conservativeResize(n);
  out.number.conservativeResize(n);
  return out;
}

}  // namespace fastcal
