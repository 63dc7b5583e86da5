// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Where an identification has come to, which its stages (start, gauge, robust noise, covariance) read and move on:
// parameters, loads at equilibrium, noise, what is free. Errors of the rows and the triangular factor are found once
// for each theta.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "fastcal/identification/identify.hpp"
#include "fastcal/identification/reduced_problem.hpp"
#include "fastcal/identification/thinned_problem.hpp"

namespace fastcal {

/// What one step of Newton came to.
struct Stepped {
  bool is_good = false;  ///< the cost fell by half of what its quadratic promised at least; else nothing moved
  double rest = 0;       ///< about the step that is left [standard deviations at the present noise]
  Eigen::MatrixXd A;     ///< of the normal equations where the step began, without priors
};

class FitState {
 public:
  /// `unknowns`: where those of the observations start. `options` and what `problem` refers to must outlive it.
  FitState(const Problem& given, std::vector<int> asked_of_model, const Eigen::VectorXd& unknowns,
           const IdentifyOptions& options);
  FitState(const FitState&) = delete;
  FitState& operator=(const FitState&) = delete;

  bool has_priors() const { return limits.prior_sigma.size() > 0; }

  /// What is left of the rows at theta.
  const RowErrors& errors_here();
  /// Takes what is left of the rows at theta.
  void know(RowErrors errors) {
    errors_ = std::move(errors);
    errors_at_ = theta;
  }

  /// How many numbers of each observation were measured.
  const std::vector<Eigen::Index>& counts();

  /// R with R^T R = J^T J of the whitened Jacobian of all that was asked for, at `there`; no priors.
  Eigen::MatrixXd asked_factor(const Eigen::VectorXd& there);

  /// The same of the free parameters, at theta: lower triangular.
  Eigen::MatrixXd free_factor();

  /// Does the factor at `there` say beyond doubt that the data fix what is free, and show nothing of what is held?
  /// False leaves it open.
  bool confirms_gauge(const Eigen::VectorXd& there);

  /// What the gauge is chosen by at `there`: the factor of the asked parameters, or that of some rows, as if all were
  /// like them, as long as the others show nothing else.
  Eigen::MatrixXd gauge_factor(const Eigen::VectorXd& there);

  /// Is the gauge that of some rows, and has step_with_factor() found that the others show nothing else?
  bool is_chosen_by_some() const { return some_ != nullptr; }
  Problem some_rows() const { return some_->problem(); }
  bool all_agree() const { return all_agree_; }
  /// The gauge is chosen by all rows from now on.
  void choose_by_all() { some_.reset(); }

  /// Loads at the present parameters, constant inside a solve but for their response.
  void bring_to_equilibrium();

  /// Loads or their response have changed: residuals and factor are recomputed.
  void forget();

  /// Minimizes over the free parameters at the present noise.
  Solution refit(LossKind with, const SolverOptions& solver);

  /// One step of Newton over parameters `of` at the present noise, judged by the residuals at its end, which the next
  /// noise is found from: a pass with the Jacobian and one without. Not within bounds. `unjudged`: shorter ones
  /// [standard deviations] are taken as they are. `is_curved`: Weighting's.
  Stepped step(LossKind with, const std::vector<int>& of, const Eigen::VectorXd& of_scale, const Limits& within,
               double unjudged = kCostTells, bool is_curved = true);

  /// The last step of all, to where the factor is wanted: by the slope that comes with the factor, and the Hessian of
  /// the last step() over the free parameters, at whatever noise where that is but a factor. False where this would
  /// not lead to the minimum, and nothing moves then.
  bool step_with_factor(bool noise_is_a_factor);

 private:
  /// Positions in `asked`: of the free parameters from the last to the first, then of those that are held. A triangular
  /// factor in this order holds that of the free ones, whose inverse is the root of their covariance.
  std::vector<int> free_first() const;
  /// The factor of the asked parameters at `there` in this order, and its g where `slope` is not null.
  void factorize(const Eigen::VectorXd& there, const Weighting& weighting, double factor, Eigen::VectorXd* slope);
  bool is_factorized(const Eigen::VectorXd& there) const {
    return factor_.size() > 0 && factor_at_ == there && factor_tau_ == tau;
  }
  bool is_factorized_by_gauge() const;
  /// The gauge at theta by the rows that it is chosen by.
  Gauge gauge_of_some();

  /// Finds the free parameters' factor by Cholesky, and their slope g, where all rows show no more than some do and the
  /// condition leaves it its digits; false where not, and it takes a QR of all rows.
  bool factor_by_sums(const CommonNoise& noise, Eigen::VectorXd& g);

  Samples settled_;  // the conditions with loads at the last outer iteration; empty where no effect needs any
  Eigen::VectorXd settled_at_;  // theta there
  TwistMemory memory_;          // what the effects make of the rows, as they are
  std::optional<RowErrors> errors_;
  Eigen::VectorXd errors_at_;
  std::vector<Eigen::Index> counts_;  // empty: not counted yet
  Eigen::MatrixXd factor_;            // upper triangular, of the asked parameters in this order
  std::vector<int> order_;            // free_first() at that time
  Eigen::VectorXd factor_at_;
  CommonNoise factor_tau_;
  std::unique_ptr<ThinnedProblem> some_;  // rows by which the gauge is chosen; null: by all of them
  bool all_agree_ = false;
  Eigen::MatrixXd free_factor_;  // of the free parameters, where it was found by sums
  Eigen::VectorXd free_factor_at_;
  std::optional<Root> root_;  // of the last step,
  CommonNoise root_tau_;      // at this noise
  double contraction_ = 1;    // what such a step leaves of the one before

 public:
  Problem problem;
  std::optional<LoadResponse> response;
  const IdentifyOptions& options;
  Limits limits;
  std::vector<Parameter> parameters;  ///< of theta, unknowns of the observations included
  std::vector<int> asked;             ///< indices into theta, unknowns included
  Eigen::VectorXd start, theta;
  Eigen::VectorXd scale, hold;  ///< of the asked: plausible size, and how readily the gauge holds it
  Gauge gauge;                  ///< positions in `asked`
  std::vector<int> free;        ///< indices into theta
  Eigen::VectorXd free_scale;
  CommonNoise tau;
  LossKind loss = LossKind::kNone;
  std::vector<bool> kept;     ///< rows that are no outliers; empty: all of them
  double measured_count = 0;  ///< measured numbers of the rows that are kept
  double effective = 0;       ///< parameters that the fit uses up, less what their priors give
  double freedom = 1;         ///< share of the squared residuals that a fit leaves: degrees of freedom by numbers
  bool claims = false;        ///< do the rows claim a noise of their own?
};

/// values[indices].
Eigen::VectorXd at(const Eigen::VectorXd& values, const std::vector<int>& indices);

/// Lower triangular R with R^T R = M^T M: its inverse is a lower triangular root of a covariance.
Eigen::MatrixXd triangle(const Eigen::MatrixXd& M);

/// Factor R of columns `indices` (scaled by `scale`) with rows 1 / sigma of their priors beneath it, so that gauge and
/// covariance see a prior like data; lower triangular, where there are priors at all.
Eigen::MatrixXd with_priors(const Eigen::MatrixXd& R, const std::vector<int>& indices, const Eigen::VectorXd& scale,
                            const Limits& limits);

}  // namespace fastcal
