// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identify.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "fastcal/identification/covariance.hpp"
#include "fastcal/identification/fit_state.hpp"
#include "fastcal/identification/gauge.hpp"
#include "fastcal/identification/robust_fit.hpp"
#include "fastcal/identification/start.hpp"
#include "fastcal/identification/thinned_problem.hpp"
#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

constexpr Eigen::Index kThinFrom = 10'000;  // rows: so many and more are identified on some of them first

/// Rows of so many from where all begin near enough for one step. What it leaves falls with the square of the distance,
/// and so with these rows; the standard deviations that it has to stay below fall with the root of all.
Eigen::Index thinned_rows(Eigen::Index count) {
  return std::max<Eigen::Index>(4'096, std::lround(8 * std::sqrt(static_cast<double>(count))));
}

constexpr double kNoiseFell = 0.5;  // relative: another noise than the one by which the free parameters were chosen

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
    robust_.begin();
    if (fit_.measured_count == 0) return too_few("nothing was measured in any row");
    near_ = begun_ || start_coarsely();
    for (int attempt = 0; attempt < 3; ++attempt) {
      if (!begun_ || (fit_.problem.model.needs() & kLoads) != 0) choose_free(fit_);
      const std::size_t free = fit_.free.size();
      const std::string asked = std::to_string(fit_.asked.size());
      if (free == 0) return too_few("the measurements determine none of the " + asked + " requested parameters");
      if (!fit_.claims && !fit_.has_priors() && fit_.options.noise.empty() &&
          fit_.measured_count <= static_cast<double>(free)) {
        return too_few("there are " + std::to_string(free) + " independent measured numbers for " + asked +
                       " parameters: any robot fits them exactly, and nothing is left to estimate the noise from");
      }
      const CommonNoise chosen_at = fit_.tau;
      const bool by_some = fit_.is_chosen_by_some();
      const bool has_loads = fit_.problem.model.needs() != kNothing;
      const bool from_near = begun_ || (near_ && attempt == 0 && !has_loads);  // the gauge has moved the loads
      robust_.run(from_near, from_near && (begun_ || by_some));
      // Where no load is, before the gauge is looked at: its factor is then that of the report.
      if (to_the_minimum && !has_loads) robust_.polish();
      if (to_the_minimum && !fit_.all_agree()) fit_.choose_by_all();
      const Gauge again = gauge_again();
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
      // What is held puts an axis upright that leans wherever the arm could be: what shows there counts.
      fit_.gauge.rank = std::max(fit_.gauge.rank, again.rank);
      if (settled) {
        if (to_the_minimum && has_loads) robust_.polish();
        break;
      }
    }
    out_.status = robust_.converged() ? Status::kConverged : Status::kNotConverged;
    return true;
  }

 private:
  /// A first fit to those rows that the gauge is chosen by, or to all; coarse_fit().
  bool start_coarsely() {
    if (!fit_.is_chosen_by_some()) return coarse_fit(fit_);
    FitState few(fit_.some_rows(), asked_, unknowns_, fit_.options);
    few.bring_to_equilibrium();
    const bool is_near = coarse_fit(few);
    fit_.theta = few.theta;
    fit_.start = few.start;
    fit_.tau = few.tau;
    return is_near;
  }

  /// The gauge where the fit has come to.
  Gauge gauge_again() {
    if (fit_.all_agree()) return fit_.gauge;
    if (!confirms_gauge(fit_)) return choose_gauge(gauge_factor(fit_), fit_.hold, fit_.options.gauge);
    Gauge same = fit_.gauge;
    same.rank = static_cast<int>(same.free.size());
    return same;
  }

  /// Did the thinned rows show what all rows do?
  bool well_begun() {
    const double noise_ratio = fit_.tau[0] / std::max(thinned_tau_[0], 1e-300);
    const Eigen::Index count = fit_.problem.row_count();
    const double share = static_cast<double>(thinned_rows(count)) / static_cast<double>(count);
    const Eigen::MatrixXd whole = fit_.free_factor() * noise_ratio;
    return represents(triangle(thinned_factor_(Eigen::all, fit_.gauge.free)), whole, share);
  }

  /// What shows in few rows alone was not seen by the thinned ones, or by too few of them.
  void begin_anew() {
    begun_ = false;
    fit_.theta = fit_.start;
    fit_.bring_to_equilibrium();
    near_ = coarse_fit(fit_);
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
    count_freedom(fit_, 0);
    fit_.tau = noise(fit_, NoiseRule::kMedian, LossKind::kHuber);
    out_ = finish();
    return false;
  }

  Identification finish() {
    report_gauge(fit_, out_);
    report_rows();
    const RowErrors& errors = fit_.errors_here();
    count_freedom(fit_, effective_parameters(fit_));
    out_.degrees_of_freedom = static_cast<int>(std::lround(fit_.measured_count - fit_.effective));
    report_noise(fit_, errors, out_);
    out_.covariance_root = covariance_root(fit_, errors);
    out_.covariance = out_.covariance_root * out_.covariance_root.transpose();
    out_.loss = fit_.loss;
    out_.theta = fit_.theta;
    out_.parameters = std::move(fit_.parameters);
    out_.free = fit_.free;
    out_.iterations = robust_.iterations();
    if (out_.message.empty()) out_.message = robust_.message();
    return std::move(out_);
  }

  /// Tells residuals and weights of the rows in memory.
  void report_rows() {
    const Problem& all = fit_.problem;
    const Problem here{all.model, all.samples, all.measured, all.threads, all.response, all.memory};
    out_.residuals = residuals(here, fit_.theta);
    RowErrors errors(here, out_.residuals);
    out_.weights = errors.weights({fit_.tau, fit_.loss});
    if (all.source == nullptr) fit_.know(std::move(errors));
  }

  const std::vector<int>& asked_;
  const Eigen::VectorXd& unknowns_;
  FitState fit_;
  RobustFit robust_{fit_};
  bool begun_ = false;  // at the solution of the thinned problem
  bool near_ = false;   // the present start is at the minimum of Huber's loss
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
  FASTCAL_CHECK(limits.lower.size() == 0 || is_least_squares(options.solver.method))
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
  const ThinnedProblem some(problem, thinned_rows(problem.row_count()));
  Identifier thinned(some.problem(), asked, unknowns, options);
  thinned.solve(false);
  whole.begin_at(thinned);
  return whole.run();
}

}  // namespace fastcal
