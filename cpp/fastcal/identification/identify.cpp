// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "fastcal/identification/covariance.hpp"
#include "fastcal/identification/fit_state.hpp"
#include "fastcal/identification/gauge.hpp"
#include "fastcal/identification/robust_noise.hpp"
#include "fastcal/identification/start.hpp"
#include "fastcal/identification/thinned_problem.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr Eigen::Index kThinFrom = 10'000;    // rows: so many and more are identified on some of them first,
constexpr Eigen::Index kThinnedRows = 4'096;  // from where all begin within a few standard deviations
constexpr int kMaxRounds = 30;
constexpr int kMaxOuterRounds = 30;
constexpr double kLoadsSettled = 1e-8;     // of a plausible size
constexpr double kLeastFreedom = 1.0 / 3;  // of the degrees of freedom must stay when outliers are dropped
constexpr double kNoiseTolerance = 0.01;   // relative, of the rows that are kept
constexpr int kRoundsOfReturn = 10;        // in which a dropped row may come back; later, some would for ever
constexpr double kNoiseFell = 0.5;  // relative: another noise than the one by which the free parameters were chosen
constexpr double kStepConverged = 3e-5;  // standard deviations: as far as a solve comes
constexpr double kRoughly = 0.03;        // standard deviations: the cost, and so the noise, is right to its square
constexpr double kNearly = 0.003;        // standard deviations: no row changes sides
constexpr double kUnjudged = 0.1;        // standard deviations: the slope at the end of so short a step tells enough
constexpr int kMaxSteps = 10;            // of Newton, before Ceres' trust region
constexpr double kNoiseStands = 2e-4;    // relative: the last step can take in such a change
constexpr double kNoiseTuned = 3e-3;     // relative, before the outliers are dropped
constexpr int kMaxPolishing = 10;
constexpr double kAtTheMinimum = 1e-10;  // standard deviations: the last step of all
constexpr double kNoiseSettled =
    1e-4;  // relative; the parameters move by far less than their deviation when the noise moves by this

constexpr double kFar = std::numeric_limits<double>::infinity();

/// The procedure: start, gauge, robust fit in turn with the loads, report.
class Identifier {
 public:
  Identifier(const Problem& problem, const std::vector<int>& asked, const Eigen::VectorXd& unknowns,
             const IdentifyOptions& options)
      : asked_(asked), unknowns_(unknowns), fit_(problem, asked, unknowns, options) {}

  /// Takes the end of an identification on some of the rows as the start; where that did not converge, nothing.
  void begin_at(Identifier& thinned) {
    if (thinned.out_.status != Status::kConverged) return;
    begun_ = true;
    fit_.theta = thinned.fit_.theta;
    fit_.start = thinned.fit_.start;
    fit_.tau = thinned.fit_.tau;
    fit_.freedom = thinned.fit_.freedom;
    fit_.gauge = thinned.fit_.gauge;
    fit_.free = thinned.fit_.free;
    fit_.free_scale = thinned.fit_.free_scale;
    thinned_factor_ = thinned.fit_.asked_factor(thinned.fit_.theta);
    thinned_tau_ = fit_.tau;
  }

  Identification run() {
    if (!solve(true)) return std::move(out_);
    return finish();
  }

  /// Everything but the report; false where there are too few numbers for one.
  bool solve(bool to_the_minimum) {
    fit_.bring_to_equilibrium();
    const auto measured = counts(fit_.problem.measured, fit_.numbers());
    keep_rows(fit_, {});
    observed_ = std::count_if(measured.begin(), measured.end(), [](Eigen::Index count) { return count > 0; });
    if (fit_.measured_count == 0) return too_few("nothing was measured in any row");
    if (!begun_) start_coarsely();
    for (int attempt = 0; attempt < 3; ++attempt) {
      if (!begun_ || (fit_.problem.model.needs() & kLoads) != 0) choose_free(fit_);
      const std::size_t free = fit_.free.size();
      const std::string asked = std::to_string(fit_.asked.size());
      if (free == 0) return too_few("the measurements fix none of the " + asked + " parameters asked for");
      if (!fit_.claims && !fit_.has_priors() && fit_.options.noise.empty() &&
          fit_.measured_count <= static_cast<double>(free)) {
        return too_few("what was measured is " + std::to_string(free) + " independent numbers for " + asked +
                       " parameters: any robot fits them exactly, and nothing is left to estimate the noise from");
      }
      const CommonNoise chosen_at = fit_.tau;
      const bool by_some = fit_.is_chosen_by_some();
      outer_iterations();
      // Where no load is, before the gauge is looked at: its factor is then that of the report.
      const bool has_loads = fit_.problem.model.needs() != kNothing;
      if (to_the_minimum && !has_loads) polish();
      if (to_the_minimum && !fit_.all_agree()) fit_.choose_by_all();
      const Gauge again =
          fit_.all_agree() ? fit_.gauge : choose_gauge(gauge_factor(fit_), fit_.hold, fit_.options.gauge);
      if (begun_ && (again.free != fit_.gauge.free || !well_begun())) {
        begin_anew();
        attempt = -1;
        continue;
      }
      // More is free where gross points that spoilt the first noise have been dropped since, or some rows did not show
      // what others do.
      const bool fewer = again.free.size() < fit_.gauge.free.size();
      const bool more = again.free.size() > fit_.gauge.free.size() &&
                        (by_some != fit_.is_chosen_by_some() || largest_change(chosen_at, fit_.tau) > kNoiseFell);
      const bool settled = (!fewer && !more) || attempt == 2;
      fit_.gauge.rank = std::max(fit_.gauge.rank, again.rank);
      if (settled) {
        if (to_the_minimum && has_loads) polish();
        break;
      }
    }
    out_.status = converged_ ? Status::kConverged : Status::kNotConverged;
    return true;
  }

 private:
  /// A first fit to those rows that the gauge is chosen by, or to all.
  void start_coarsely() {
    if (!fit_.is_chosen_by_some()) {
      coarse_fit(fit_);
      return;
    }
    FitState few(fit_.some_rows(), asked_, unknowns_, fit_.options);
    few.bring_to_equilibrium();
    coarse_fit(few);
    fit_.theta = few.theta;
    fit_.start = few.start;
    fit_.tau = few.tau;
  }

  /// Solves at fixed loads, brings the loads to the equilibrium of what was found, and again until parameters and noise
  /// stand.
  void outer_iterations() {
    for (int round = 0; round < kMaxRounds; ++round) {
      fine_fit();
      if (fit_.problem.model.needs() == kNothing || !settle_loads()) return;
      // The loads were right to a per mille already, so the noise hardly moves: it is found again only where it does.
      if (largest_change(tuned_, noise(fit_, NoiseRule::kMean, fit_.loss)) < kNoiseSettled) return;
    }
  }

  /// Loads and parameters in turn, at the noise that was found; false where they do not come to rest.
  bool settle_loads() {
    for (int round = 0; round < kMaxOuterRounds; ++round) {
      const Eigen::VectorXd before = at(fit_.theta, fit_.free);
      fit_.bring_to_equilibrium();
      refit(fit_.loss);
      const Eigen::VectorXd moved = (at(fit_.theta, fit_.free) - before).cwiseQuotient(fit_.free_scale);
      if (moved.cwiseAbs().maxCoeff() < kLoadsSettled || deviations(moved) < kStepConverged) return true;
    }
    converged_ = false;
    out_.message = "loads and deflections did not settle in " + std::to_string(kMaxOuterRounds) + " outer iterations";
    return false;
  }

  /// Length of a step of the free parameters (scaled), in standard deviations of what was measured.
  double deviations(const Eigen::VectorXd& step) const {
    if (near_.rows() == step.size()) return std::sqrt(std::max(0.0, step.dot(near_ * step)));
    const NormalEquations near =
        normal_equations(fit_.problem, fit_.theta, fit_.free, fit_.free_scale, {fit_.tau, fit_.loss}, true);
    return std::sqrt(std::max(0.0, step.dot(near.A * step)));
  }

  /// To the minimum itself, in turn with its noise and its loads: what rounding made of the way there (another
  /// instruction set, say) is forgotten.
  void polish() {
    SolverOptions solver = fit_.options.solver;
    if (!converged_ || solver.method != Method::kLeastSquares) return;
    if (step_to_the_minimum()) return;
    solver.settled = kAtTheMinimum;
    refit(fit_.loss, solver);
    fit_.tau = noise(fit_, rule_, fit_.loss);
    if (fit_.problem.model.needs() != kNothing) {
      polish_with_loads(solver);
    } else if (!noise_is_a_factor()) {
      refit(fit_.loss, solver);
      fit_.tau = noise(fit_, rule_, fit_.loss);
    }
    converged_ = true;
  }

  /// The same where neither loads, priors nor bounds are: by steps of Newton, the last with the factor of the report.
  bool step_to_the_minimum() {
    const Limits& limits = fit_.limits;
    if (fit_.problem.model.needs() != kNothing || fit_.has_priors() || limits.pull_sigma.size() > 0) return false;
    const bool is_factor = noise_is_a_factor();
    if (!is_factor) fit_.tau = noise(fit_, rule_, fit_.loss);
    bool is_near = rest_ <= kNearly && (is_factor || largest_change(fitted_at_, fit_.tau) < kNoiseStands);
    for (int k = 0; k < kMaxSteps; ++k) {
      if (is_near && fit_.step_with_factor(is_factor)) {
        out_.message = "the step that is left is below 0.0001 standard deviations";
        return true;
      }
      const Stepped step = fit_.step(fit_.loss, fit_.free, fit_.free_scale, limits, kUnjudged);
      if (!step.is_good) return false;
      ++out_.iterations;
      is_near = step.rest <= kNearly;
    }
    return false;
  }

  void polish_with_loads(const SolverOptions& solver) {
    for (int round = 0; round < kMaxPolishing; ++round) {
      const Eigen::VectorXd before = at(fit_.theta, fit_.free);
      if (round < 2) follow_loads(fit_);  // the loads' response is part of the slope, and was taken far from here
      fit_.bring_to_equilibrium();
      refit(fit_.loss, solver);
      const Eigen::VectorXd moved = (at(fit_.theta, fit_.free) - before).cwiseQuotient(fit_.free_scale);
      if (deviations(moved) < kAtTheMinimum) return;
      fit_.tau = noise(fit_, rule_, fit_.loss);
    }
  }

  /// Where all numbers are of one observation, without a loss, claims of the rows' own or priors, the noise scales the
  /// cost and nothing else.
  bool noise_is_a_factor() const {
    return fit_.loss == LossKind::kNone && observed_ == 1 && !fit_.claims && !fit_.has_priors();
  }

  /// Did the thinned rows show what all rows do?
  bool well_begun() {
    const double noise_ratio = fit_.tau[0] / std::max(thinned_tau_[0], 1e-300);
    const double share = static_cast<double>(kThinnedRows) / static_cast<double>(fit_.problem.row_count());
    const Eigen::MatrixXd whole = fit_.free_factor() * noise_ratio;
    return represents(triangle(thinned_factor_(Eigen::all, fit_.gauge.free)), whole, share);
  }

  /// What shows in few rows alone was not seen by the thinned ones, or by too few of them.
  void begin_anew() {
    begun_ = false;
    fit_.theta = fit_.start;
    fit_.bring_to_equilibrium();
    coarse_fit(fit_);
  }

  void refit(LossKind loss) { refit(loss, fit_.options.solver); }

  /// As near as the next estimate of the noise needs it.
  void refit_roughly(LossKind loss) {
    for (int k = 0; k < kMaxSteps; ++k) {
      if (approach(loss)) return;
    }
  }

  /// A step nearer at the present noise, or all the way where that is not a good one; is it now as near as the next
  /// estimate of the noise needs it?
  bool approach(LossKind loss) {
    SolverOptions solver = fit_.options.solver;
    rest_ = kFar;
    if (solver.method == Method::kLeastSquares) {
      Stepped step = fit_.step(loss, fit_.free, fit_.free_scale, fit_.limits);
      if (step.is_good) {
        ++out_.iterations;
        near_ = std::move(step.A);
        rest_ = step.rest;
        converged_ = rest_ <= kRoughly;
        fitted_at_ = fit_.tau;
        count_freedom(fit_);
        return converged_ && out_.iterations <= solver.max_iterations;
      }
    }
    solver.settled = std::max(solver.settled, kRoughly);
    refit(loss, solver);
    return true;
  }

  void refit(LossKind loss, const SolverOptions& solver) {
    Solution solution = fit_.refit(loss, solver);
    fitted_at_ = fit_.tau;
    near_ = std::move(solution.A);
    converged_ = solution.converged;
    count_freedom(fit_);
    out_.iterations += solution.iterations;
    out_.message = solution.message;
  }

  /// MM-estimation: Huber's loss at the median noise, whose minimum is one; from there the asked loss, alternating with
  /// the M-scale of the noise until neither moves; then at the noise of the rows that are no outliers.
  void fine_fit() {
    keep_rows(fit_, {});
    rule_ = NoiseRule::kMean;
    const LossKind loss = fit_.loss = shows_outliers(fit_) ? fit_.options.loss : LossKind::kNone;
    if (loss != LossKind::kNone && !begun_) {
      for (int round = 0; round < kMaxRounds; ++round) {
        const bool is_near = approach(LossKind::kHuber);
        const CommonNoise before = fit_.tau;
        fit_.tau = noise(fit_, NoiseRule::kMedian, LossKind::kHuber);
        if (is_near && largest_change(before, fit_.tau) < kNoiseTolerance) break;
      }
    }
    const bool has_loads = fit_.problem.model.needs() != kNothing;  // then the outer iterations ask for more
    const double tuned = loss == LossKind::kNone || has_loads ? kNoiseSettled : kNoiseTuned;
    bool is_near = false;
    for (int round = 0; round < kMaxRounds; ++round) {
      const CommonNoise before = fit_.tau;
      if (round > 0 || !begun_) fit_.tau = noise(fit_, NoiseRule::kMean, loss);
      if (is_near && largest_change(before, fit_.tau) < tuned) break;
      is_near = approach(loss);
      if (is_near && noise_is_a_factor()) {
        tuned_ = fit_.tau = noise(fit_, NoiseRule::kMean, loss);
        return;
      }
    }
    tuned_ = fit_.tau;
    if (loss != LossKind::kNone) drop_outliers();
  }

  /// Outliers are found, dropped and everything refitted at the noise of the others until the same rows are left and
  /// their noise stands: each refit explains the good rows better and shows outliers that hid in the noise of the last.
  /// The first are found at the median noise, which up to half of the rows cannot spoil.
  void drop_outliers() {
    const double least = kLeastFreedom * fit_.freedom * fit_.measured_count;
    fit_.tau = noise(fit_, NoiseRule::kMedian, fit_.loss);
    for (double& tau : fit_.tau) tau /= std::sqrt(fit_.freedom);
    for (int round = 0; round < kMaxRounds; ++round) {
      std::vector<bool> kept = explained_rows(fit_);
      for (std::size_t i = 0; round >= kRoundsOfReturn && i < kept.size(); ++i) kept[i] = kept[i] && fit_.kept[i];
      if (round > 0 && kept == fit_.kept &&
          largest_change(fit_.tau, noise(fit_, NoiseRule::kKept, fit_.loss)) < kNoiseTolerance) {
        return;
      }
      keep_rows(fit_, std::move(kept));
      if (fit_.freedom * fit_.measured_count < least) break;
      rule_ = NoiseRule::kKept;
      fit_.tau = noise(fit_, NoiseRule::kKept, fit_.loss);
      if (largest_change(fitted_at_, fit_.tau) > kNoiseTolerance) refit_roughly(fit_.loss);
    }
    // No set of rows holds together: none is dropped.
    keep_rows(fit_, {});
    rule_ = NoiseRule::kMean;
    fit_.tau = tuned_;
    refit(fit_.loss);
  }

  /// All stay where they started.
  bool too_few(const std::string& message) {
    out_.status = Status::kTooFewEquations;
    out_.message = message;
    fit_.theta = fit_.start;
    fit_.free.clear();
    fit_.gauge.free.clear();
    fit_.gauge.held.resize(fit_.asked.size());
    std::iota(fit_.gauge.held.begin(), fit_.gauge.held.end(), 0);
    fit_.gauge.directions.resize(static_cast<Eigen::Index>(fit_.asked.size()), 0);
    count_freedom(fit_);
    fit_.tau = noise(fit_, NoiseRule::kMedian, LossKind::kHuber);
    out_ = finish();
    return false;
  }

  Identification finish() {
    report_gauge(fit_, out_);
    out_.residuals = fit_.residuals_here();
    out_.weights = row_weights(fit_.problem, out_.residuals, {fit_.tau, fit_.loss});
    out_.degrees_of_freedom = static_cast<int>(std::lround(fit_.measured_count - effective_parameters(fit_)));
    report_noise(fit_, out_);
    out_.covariance_root = covariance_root(fit_, out_.weights);
    out_.covariance = out_.covariance_root * out_.covariance_root.transpose();
    out_.loss = fit_.loss;
    out_.theta = fit_.theta;
    out_.parameters = fit_.parameters;
    out_.free = fit_.free;
    return std::move(out_);
  }

  const std::vector<int>& asked_;
  const Eigen::VectorXd& unknowns_;
  FitState fit_;
  NoiseRule rule_ = NoiseRule::kMean;  // by which the noise was found last
  CommonNoise tuned_;                  // the noise before the last step of fine_fit, which leaves the outliers out
  std::ptrdiff_t observed_ = 0;
  Eigen::MatrixXd near_;   // of the normal equations, where the last fit found them
  CommonNoise fitted_at_;  // the noise of the last fit
  double rest_ = kFar;     // about the step that it left [standard deviations]; far: not known
  bool converged_ = false;
  bool begun_ = false;  // at the solution of the thinned problem
  Eigen::MatrixXd thinned_factor_;
  CommonNoise thinned_tau_;
  Identification out_;
};

void check_limits(const IdentifyOptions& options, int count) {
  const Limits& limits = options.limits;
  const auto fits = [count](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return a.size() == b.size() && (a.size() == 0 || a.size() == count);
  };
  FASTCAL_CHECK(fits(limits.prior_mean, limits.prior_sigma))
      << "priors must be " << count << " means and as many standard deviations, or none";
  FASTCAL_CHECK(limits.prior_mean.allFinite() && (limits.prior_sigma.array() > 0).all())
      << "priors must have finite means and positive standard deviations";
  FASTCAL_CHECK(fits(limits.pull_mean, limits.pull_sigma) && limits.pull_mean.allFinite() &&
                (limits.pull_sigma.array() > 0).all())
      << "pulls must be " << count << " finite means and as many positive sizes, or none";
  FASTCAL_CHECK(fits(limits.lower, limits.upper))
      << "bounds must be " << count << " lower and as many upper ones, or none";
  FASTCAL_CHECK((limits.lower.array() < limits.upper.array()).all())
      << "each lower bound must be below its upper bound";
  FASTCAL_CHECK(limits.lower.size() == 0 || options.solver.method == Method::kLeastSquares)
      << "bounds need least squares; BFGS with a line search has none";
}

}  // namespace

Identification identify(const Problem& problem, const std::vector<int>& asked, const Eigen::VectorXd& unknowns,
                        const IdentifyOptions& options) {
  problem.check();
  for (const int index : asked) {
    FASTCAL_CHECK(index >= 0 && index < problem.model.parameter_count())
        << "asked parameters must be 0 to " << problem.model.parameter_count() - 1 << ", got " << index;
  }
  FASTCAL_CHECK(std::set<int>(asked.begin(), asked.end()).size() == asked.size())
      << "asked parameters must differ from each other";
  check_limits(options, problem.parameter_count());
  FASTCAL_CHECK(options.noise.empty() || options.noise.size() == problem.measured.observations().size())
      << "there are " << problem.measured.observations().size() << " observations, got " << options.noise.size()
      << " standard deviations of their noise";
  FASTCAL_CHECK(unknowns.allFinite()) << "starting values of the observations' unknowns must be finite";
  FASTCAL_CHECK(unknowns.size() == problem.measured.unknown_count())
      << "the observations have " << problem.measured.unknown_count() << " unknowns, got " << unknowns.size()
      << " starting values";
  Identifier whole(problem, asked, unknowns, options);
  if (problem.row_count() < kThinFrom || options.solver.method != Method::kLeastSquares) return whole.run();
  const ThinnedProblem some(problem, kThinnedRows);
  Identifier thinned(some.problem(), asked, unknowns, options);
  thinned.solve(false);
  whole.begin_at(thinned);
  return whole.run();
}

}  // namespace fastcal
