// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The fit of the free parameters: parameters, noise, outliers and loads in turn, down to the minimum.
#pragma once

#include <limits>
#include <string>

#include "fastcal/identification/fit_state.hpp"
#include "fastcal/identification/robust_noise.hpp"

namespace fastcal {

class RobustFit {
 public:
  explicit RobustFit(FitState& fit) : fit_(fit) {}

  /// Counts what was measured.
  void begin();

  /// Solves at fixed loads, brings the loads to the equilibrium of what was found, and again until parameters and noise
  /// stand. `from_near`: from within a few standard deviations, at a noise that no gross row has spoilt; is it known
  /// from enough rows to weigh them by?
  void run(bool from_near, bool knows_noise);

  /// To the minimum itself, in turn with its noise and its loads: what rounding made of the way there (another
  /// instruction set, say) is forgotten.
  void polish();

  bool converged() const { return converged_; }
  int iterations() const { return iterations_; }
  const std::string& message() const { return message_; }

 private:
  /// Loads and parameters in turn, at the noise that was found; false where they do not come to rest.
  bool settle_loads();

  /// Do many of the rows that are kept fit no more, with loads and frames as they are now? A redescending loss would
  /// leave them out for good.
  bool loses_rows();
  /// Length of a step of the free parameters (scaled), in standard deviations of what was measured.
  double deviations(const Eigen::VectorXd& step) const;
  /// polish() where neither loads, priors nor bounds are: steps of Newton, the last with the factor of the report.
  bool step_to_the_minimum();
  void polish_with_loads(const SolverOptions& solver);
  /// Where all numbers are of one observation, without a loss, claims of the rows' own or priors, the noise scales the
  /// cost and nothing else.
  bool noise_is_a_factor() const;
  void refit(LossKind loss, const SolverOptions& solver);
  /// The step [standard deviations] whose rest leaves the next estimate of the noise right to kNoiseStands: its square
  /// is what the sum of squares, one a degree of freedom, is larger.
  double roughly() const;
  /// As near as that.
  void refit_roughly(LossKind loss);
  /// A step nearer at the present noise, or all the way where that is not a good one; is it now as near as
  /// roughly()?
  bool approach(LossKind loss);
  /// MM-estimation: Huber's loss at the median noise, whose minimum is one; from there the asked loss, alternating with
  /// the M-scale of the noise until neither moves; then at the noise of the rows that are no outliers.
  void fine_fit(bool from_near, bool knows_noise);
  /// Outliers are found, dropped and everything refitted at the noise of the others until the same rows are left and
  /// their noise stands: each refit explains the good rows better and shows outliers that hid in the noise of the last.
  /// The first are found at the median noise, which up to half of the rows cannot spoil.
  void drop_outliers();

  static constexpr double kFar = std::numeric_limits<double>::infinity();

  FitState& fit_;
  NoiseRule rule_ = NoiseRule::kMean;  // by which the noise was found last
  CommonNoise tuned_;                  // the noise before the last step of fine_fit, which leaves the outliers out
  std::ptrdiff_t observed_ = 0;
  Eigen::MatrixXd near_;   // of the normal equations, where the last fit found them
  CommonNoise fitted_at_;  // the noise of the last fit
  double rest_ = kFar;     // about the step that it left [standard deviations]; far: not known
  bool converged_ = false;
  int iterations_ = 0;
  std::string message_;
};

}  // namespace fastcal
