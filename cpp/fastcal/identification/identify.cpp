// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/identify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "fastcal/identification/load_response.hpp"
#include "fastcal/identification/noise_scale.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

// Below this a residual is rounding, not noise: exact, simulated data must not divide by zero.
constexpr CommonNoise kNoiseFloor{1e-10, 1e-10, 1e-10};
constexpr int kMaxRounds = 30;
constexpr int kMaxOuterRounds = 30;
constexpr double kLoadsSettled = 1e-8;  // of a plausible size
constexpr double kNothingMoved = 3e-5;  // standard deviations: as far as a solve comes
constexpr double kNoiseSettled =
    1e-4;  // relative; the parameters move by far less than their deviation when the noise moves by this

/// How many numbers of each kind were measured.
std::array<Eigen::Index, kKinds> counts(const RowMatrixXd& r) {
  std::array<Eigen::Index, kKinds> out{};
  for (int c = 0; c < kComponents; ++c)
    out[static_cast<std::size_t>(kind_of(c))] += (r.col(c).array() == r.col(c).array()).count();
  return out;
}

Eigen::VectorXd at(const Eigen::VectorXd& values, const std::vector<int>& indices) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(indices.size()));
  for (std::size_t k = 0; k < indices.size(); ++k) out[static_cast<Eigen::Index>(k)] = values[indices[k]];
  return out;
}

/// The triangle of the QR factorization.
Eigen::MatrixXd triangle(const Eigen::MatrixXd& M) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(M).matrixQR().topRows(M.cols()).triangularView<Eigen::Upper>();
}

/// Rows of a prior under the triangular factor, so that the gauge and the covariance see it like data.
Eigen::MatrixXd with_priors(const Eigen::MatrixXd& R, const std::vector<int>& asked, const Eigen::VectorXd& scale,
                            const Limits& limits) {
  if (limits.prior_sigma.size() == 0) return R;
  const Eigen::Index p = R.cols();
  Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(2 * p, p);
  stacked.topRows(p) = R;
  for (Eigen::Index k = 0; k < p; ++k) {
    const double sigma = limits.prior_sigma[asked[static_cast<std::size_t>(k)]];
    if (std::isfinite(sigma)) stacked(p + k, k) = scale[k] / sigma;
  }
  return triangle(stacked);
}

/// The work of identify(), step by step.
class Identifier {
 public:
  Identifier(const Problem& problem, std::vector<int> asked, const Eigen::Matrix3Xd& anchors,
             const IdentifyOptions& options)
      : settled_(problem.model.needs() == kNothing ? Samples() : problem.samples),
        problem_{problem.model,    problem.model.needs() == kNothing ? problem.samples : settled_,
                 problem.measured, problem.threads,
                 nullptr,          &memory_},
        options_(options),
        asked_(std::move(asked)) {
    out_.parameters = problem.model.parameters();
    for (int a = 0; a < problem.measured.anchor_count; ++a) {
      for (const char* axis : {"x", "y", "z"}) {
        asked_.push_back(static_cast<int>(out_.parameters.size()));
        out_.parameters.push_back(
            {"anchor" + std::to_string(a), axis, "m", 1e-3, "place of the anchor in the measuring frame"});
      }
    }
    start_.resize(problem.parameter_count());
    start_ << problem.model.start(), Eigen::Map<const Eigen::VectorXd>(anchors.data(), anchors.size());
    theta_ = start_;
    scale_.resize(static_cast<Eigen::Index>(asked_.size()));
    hold_.resize(scale_.size());
    for (Eigen::Index k = 0; k < scale_.size(); ++k) {
      const Parameter& parameter = out_.parameters[static_cast<std::size_t>(asked_[static_cast<std::size_t>(k)])];
      scale_[k] = parameter.sigma;
      // Ties (two parallel axes) fall to the first in the chain, the same on every machine.
      hold_[k] = hold_preference(parameter) * (1 - 1e-3 * static_cast<double>(k) / static_cast<double>(scale_.size()));
    }
    limits_ = options.limits;
    claims_ = problem.measured.sigma_position.size() + problem.measured.sigma_rotation.size() > 0;
  }

  Identification run() {
    bring_to_equilibrium();
    const auto measured = counts(left());
    numbers_ = static_cast<double>(std::accumulate(measured.begin(), measured.end(), Eigen::Index{0}));
    kinds_ = std::count_if(measured.begin(), measured.end(), [](Eigen::Index count) { return count > 0; });
    if (numbers_ == 0) return too_few("nothing was measured in any row");
    coarse_fit();
    for (int attempt = 0; attempt < 3; ++attempt) {
      choose();
      if (free_.empty())
        return too_few("the measurements fix none of the " + std::to_string(asked_.size()) + " parameters asked for");
      if (!claims_ && !has_priors() && numbers_ <= static_cast<double>(free_.size())) {
        return too_few("what was measured is " + std::to_string(free_.size()) + " independent numbers for " +
                       std::to_string(asked_.size()) +
                       " parameters: any robot fits them exactly, and nothing is left to tell their noise");
      }
      outer_iterations();
      const Gauge again = choose_gauge(factor(), hold_, options_.gauge);
      const bool settled = again.free.size() >= gauge_.free.size() || attempt == 2;
      gauge_.rank = std::max(gauge_.rank, again.rank);
      if (settled) break;
    }
    out_.status = converged_ ? Status::kConverged : Status::kNotConverged;
    return finish();
  }

 private:
  bool has_priors() const { return limits_.prior_sigma.size() > 0; }

  /// Numbers that the fit uses up: the free parameters, less what their priors give, |J R^-1|^2 with R^T R = J^T J +
  /// priors.
  double spent() {
    if (!has_priors()) return static_cast<double>(free_.size());
    const Eigen::MatrixXd J = free_factor();
    const Eigen::MatrixXd R = with_priors(J, free_, free_scale_, limits_);
    return R.transpose().triangularView<Eigen::Lower>().solve(J.transpose()).squaredNorm();
  }

  /// The share of the squared residuals that a fit leaves.
  void count_freedom() { freedom_ = std::max(1.0, numbers_ - spent()) / numbers_; }

  /// The present parameters on an arm that its beams do not bend. What moves the frames along the arm and nothing else
  /// looks as if the bend could tell it; how the bend itself would change with it, no derivative holds.
  Eigen::VectorXd unbent() const {
    Eigen::VectorXd theta = theta_;
    Eigen::Index first = problem_.model.robot().nominal().size();
    for (const auto& effect : problem_.model.effects()) {
      const auto count = static_cast<Eigen::Index>(effect->parameters().size());
      if (effect->needs() & kBending) theta.segment(first, count).setZero();
      first += count;
    }
    return theta;
  }

  /// Triangular factor of all that was asked for, found once.
  const Eigen::MatrixXd& asked_factor(const Eigen::VectorXd& theta) {
    if (factor_.size() == 0 || factor_at_ != theta || factor_tau_ != tau_) {
      factor_ = triangular_factor(problem_, theta, asked_, scale_, tau_, nullptr);
      factor_at_ = theta;
      factor_tau_ = tau_;
    }
    return factor_;
  }

  /// The same of the free ones, at theta.
  Eigen::MatrixXd free_factor() {
    const Eigen::MatrixXd& R = asked_factor(theta_);
    return triangle(R(Eigen::all, gauge_.free));
  }

  /// What the gauge is chosen by.
  Eigen::MatrixXd factor() { return with_priors(asked_factor(unbent()), asked_, scale_, options_.limits); }

  /// All asked parameters under weak priors (30 plausible sizes) and Huber's loss: a start near the solution whatever
  /// the data can't tell.
  void coarse_fit() {
    constexpr double kWeak = 30;
    Limits weak = limits_;
    if (!has_priors()) {
      weak.prior_mean = start_;
      weak.prior_sigma = Eigen::VectorXd::Constant(start_.size(), std::numeric_limits<double>::infinity());
    }
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      double& sigma = weak.prior_sigma[asked_[k]];
      if (!std::isfinite(sigma)) weak.prior_mean[asked_[k]] = start_[asked_[k]];
      sigma = std::min(sigma, kWeak * scale_[static_cast<Eigen::Index>(k)]);
    }
    tau_ = noise(NoiseRule::kMedian, LossKind::kHuber);
    for (int round = 0; round < 6; ++round) {
      // Few steps a round: this is a start, and the next round weights the rows anew.
      const Solution solution =
          solve(problem_, theta_, asked_, scale_, {tau_, LossKind::kHuber}, weak, {Method::kLeastSquares, 3, 0.1});
      theta_ = solution.theta;
      bring_to_equilibrium();
      const CommonNoise before = tau_;
      tau_ = noise(NoiseRule::kMedian, LossKind::kHuber);
      if (largest_change(before, tau_) < 0.05) break;
    }
  }

  /// Residuals at theta, found once.
  const RowMatrixXd& left() const {
    if (left_.rows() == 0 || left_at_ != theta_) {
      left_ = residuals(problem_, theta_);
      left_at_ = theta_;
    }
    return left_;
  }

  enum class NoiseRule { kMedian, kMean, kClean };

  /// Noise common to all rows, by kind, for the residuals at theta.
  CommonNoise noise(NoiseRule rule, LossKind loss) const {
    const RowMatrixXd& r = left();
    CommonNoise out = kNoiseFloor;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const std::vector<KindRow> rows = rows_of_kind(problem_, r, static_cast<int>(k));
      if (rows.empty()) continue;
      if (rule == NoiseRule::kMedian) out[k] = median_noise(rows, kNoiseFloor[k], tau_[k]);
      if (rule == NoiseRule::kMean) out[k] = mean_noise(rows, loss, freedom_, kNoiseFloor[k], tau_[k]);
      if (rule == NoiseRule::kClean) out[k] = clean_noise(rows, freedom_, kNoiseFloor[k], tau_[k]);
    }
    return out;
  }

  static double largest_change(const CommonNoise& a, const CommonNoise& b) {
    double change = 0;
    for (std::size_t k = 0; k < a.size(); ++k) change = std::max(change, std::abs(a[k] - b[k]) / std::max(a[k], b[k]));
    return change;
  }

  /// The gauge at theta, and theta moved along the null directions so that the held parameters come back to where they
  /// started.
  void choose() {
    follow_loads();
    gauge_ = choose_gauge(factor(), hold_, options_.gauge);
    Eigen::VectorXd x = (at(theta_, asked_) - at(start_, asked_)).cwiseQuotient(scale_);
    for (std::size_t k = 0; k < gauge_.held.size(); ++k) {
      x -= x[gauge_.held[k]] * gauge_.directions.col(static_cast<Eigen::Index>(k));
    }
    free_.clear();
    for (const int k : gauge_.free) free_.push_back(asked_[static_cast<std::size_t>(k)]);
    for (std::size_t k = 0; k < asked_.size(); ++k)
      theta_[asked_[k]] = start_[asked_[k]] + scale_[static_cast<Eigen::Index>(k)] * x[static_cast<Eigen::Index>(k)];
    for (const int k : gauge_.held)
      theta_[asked_[static_cast<std::size_t>(k)]] = start_[asked_[static_cast<std::size_t>(k)]];
    free_scale_ = at(scale_, gauge_.free);
  }

  /// Loads at the present parameters: constant inside a solve, but for their response.
  void bring_to_equilibrium() {
    if (problem_.model.needs() != kNothing) {
      settle(problem_.model, theta_.head(problem_.model.parameter_count()), problem_.threads, settled_);
      memory_.forget();
    }
    memory_.prepare(problem_.row_count());
    if (response_) response_->origin = theta_;
    forget();
  }

  /// Loads have moved: what was found before no longer holds.
  void forget() {
    left_.resize(0, 0);
    factor_.resize(0, 0);
  }

  /// Finds along which directions the loads' own change counts, from here on.
  void follow_loads() {
    if ((problem_.model.needs() & kLoads) == 0) return;
    problem_.response = nullptr;
    forget();
    response_ = load_response(problem_, theta_, asked_, scale_, factor());
    if (response_) problem_.response = &*response_;
    forget();
  }

  /// Solves at fixed loads, brings the loads to the equilibrium of what was found, and again until parameters and noise
  /// stand.
  void outer_iterations() {
    for (int round = 0; round < kMaxRounds; ++round) {
      fine_fit();
      if (problem_.model.needs() == kNothing || !settle_loads()) return;
      // The loads were right to a per mille already, so the noise hardly moves: it is found anew only where it does.
      if (largest_change(tuned_, noise(NoiseRule::kMean, loss_)) < kNoiseSettled) return;
    }
  }

  /// Loads and parameters in turn, at the noise that was found; false where they do not come to rest.
  bool settle_loads() {
    for (int round = 0; round < kMaxOuterRounds; ++round) {
      const Eigen::VectorXd before = at(theta_, free_);
      bring_to_equilibrium();
      refit(loss_);
      const Eigen::VectorXd moved = (at(theta_, free_) - before).cwiseQuotient(free_scale_);
      if (moved.cwiseAbs().maxCoeff() < kLoadsSettled || deviations(moved) < kNothingMoved) return true;
    }
    converged_ = false;
    out_.message = "loads and deflections did not settle in " + std::to_string(kMaxOuterRounds) + " outer iterations";
    return false;
  }

  /// Length of a step of the free parameters (scaled), in standard deviations of what was measured.
  double deviations(const Eigen::VectorXd& step) const {
    const NormalEquations near = normal_equations(problem_, theta_, free_, free_scale_, {tau_, loss_}, true);
    return std::sqrt(std::max(0.0, step.dot(near.A * step)));
  }

  void refit(LossKind loss) {
    const Solution solution = solve(problem_, theta_, free_, free_scale_, {tau_, loss}, limits_, options_.solver);
    theta_ = solution.theta;
    converged_ = solution.converged;
    count_freedom();
    out_.iterations += solution.iterations;
    out_.message = solution.message;
  }

  /// MM-estimation: Huber's loss at the median noise, whose minimum is one; from there the asked loss, alternating with
  /// the M-scale of the noise until neither moves; then once more at the noise of the rows that are no outliers.
  void fine_fit() {
    loss_ = options_.loss;
    if (loss_ != LossKind::kNone) {
      for (int round = 0; round < 3; ++round) {
        refit(LossKind::kHuber);
        tau_ = noise(NoiseRule::kMedian, LossKind::kHuber);
      }
    }
    for (int round = 0; round < kMaxRounds; ++round) {
      const CommonNoise before = tau_;
      tau_ = noise(NoiseRule::kMean, loss_);
      if (round > 0 && largest_change(before, tau_) < kNoiseSettled) break;
      refit(loss_);
      // Where all numbers are of one kind, without a loss, claims of the rows' own or priors, the noise scales the cost
      // and nothing else.
      if (loss_ == LossKind::kNone && kinds_ == 1 && !claims_ && !has_priors()) {
        tuned_ = tau_ = noise(NoiseRule::kMean, loss_);
        return;
      }
    }
    tuned_ = tau_;
    if (loss_ == LossKind::kNone) return;
    tau_ = noise(NoiseRule::kClean, loss_);
    refit(loss_);
  }

  /// All stay where they started.
  Identification too_few(const std::string& message) {
    out_.status = Status::kTooFewEquations;
    out_.message = message;
    theta_ = start_;
    free_.clear();
    gauge_.free.clear();
    gauge_.held.resize(asked_.size());
    std::iota(gauge_.held.begin(), gauge_.held.end(), 0);
    gauge_.directions.resize(0, 0);
    count_freedom();
    tau_ = noise(NoiseRule::kMedian, LossKind::kHuber);
    return finish();
  }

  Identification finish() {
    out_.theta = theta_;
    out_.free = free_;
    for (const int k : gauge_.held) out_.held.push_back(asked_[static_cast<std::size_t>(k)]);
    out_.rank = has_priors() ? choose_gauge(asked_factor(unbent()), hold_).rank : gauge_.rank;
    std::vector<Parameter> asked_parameters;
    for (const int index : asked_) asked_parameters.push_back(out_.parameters[static_cast<std::size_t>(index)]);
    out_.unidentifiable = describe_directions(gauge_, asked_parameters);
    for (std::size_t column = 0; column < out_.unidentifiable.size(); ++column) {
      std::vector<int> parts{asked_[static_cast<std::size_t>(gauge_.held[column])]};
      const Eigen::VectorXd direction = gauge_.directions.col(static_cast<Eigen::Index>(column));
      for (std::size_t k = 0; k < asked_.size(); ++k) {
        if (static_cast<int>(k) != gauge_.held[column] && std::abs(direction[static_cast<Eigen::Index>(k)]) > 0.02)
          parts.push_back(asked_[k]);
      }
      out_.unidentifiable_parts.push_back(std::move(parts));
    }
    out_.residuals = left();
    out_.weights = row_weights(problem_, out_.residuals, {tau_, loss_});
    out_.tau = tau_;
    out_.degrees_of_freedom = static_cast<int>(std::lround(numbers_ - spent()));
    own_and_common_noise();
    covariance();
    return std::move(out_);
  }

  void own_and_common_noise() {
    CommonNoise squares{};
    const auto measured = counts(out_.residuals);
    for (int c = 0; c < kComponents; ++c) {
      const auto k = static_cast<std::size_t>(kind_of(c));
      for (Eigen::Index i = 0; i < out_.residuals.rows(); ++i) {
        if (std::isnan(out_.residuals(i, c))) continue;
        const double own = problem_.measured.sigma(i, c);
        squares[k] += own * own + tau_[k] * tau_[k];
      }
    }
    for (std::size_t k = 0; k < squares.size(); ++k) {
      if (measured[k] == 0) {
        out_.tau[k] = 0;
        continue;
      }
      if (tau_[k] <= kNoiseFloor[k] && claims_) out_.tau[k] = 0;
      out_.sigma[k] = std::sqrt(squares[k] / static_cast<double>(measured[k]));
    }
    out_.variance_factor = variance_factor();
    for (double& sigma : out_.sigma) sigma *= std::sqrt(out_.variance_factor);
  }

  /// What all variances must be multiplied by for the weighted squares to be what they should: below 1 only where the
  /// rows claim more noise than there is. The weights are taken at the noise that comes out.
  double variance_factor() const {
    double factor = 1;
    for (int round = 0; round < 50; ++round) {
      double sum = 0;
      double expected = 0;
      for (const RowWeight& row : out_.weights) {
        if (row.components == 0) continue;
        const Loss& rho = tuned_loss(loss_, row.components);
        const double s = row.squared / freedom_;
        const double weight = rho.weight(s / factor);
        if (!(weight > 0)) continue;
        sum += weight * s;
        expected += rho.consistency * row.components;
      }
      if (!(expected > 0 && sum > 0)) return factor;
      const double change = std::abs(sum / expected - factor);
      factor = sum / expected;
      if (change <= 1e-9 * factor) break;
    }
    return factor;
  }

  void covariance() {
    const auto p = static_cast<Eigen::Index>(free_.size());
    if (p == 0) return;
    Eigen::MatrixXd R = free_factor();
    // Rows that measure nothing carry no information and are not in R; rows with weight 0 are in it, and A below counts
    // them out.
    const LossKind used = options_.solver.method == Method::kBfgsMeanDistance ? LossKind::kDistance : loss_;
    const double inflation = variance_inflation(out_.weights, used, freedom_);
    R /= std::sqrt(std::max(inflation, std::numeric_limits<double>::min()));
    R = with_priors(R, free_, free_scale_, options_.limits);
    const Eigen::MatrixXd inverse = R.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(p, p));
    out_.covariance = free_scale_.asDiagonal() * inverse * inverse.transpose() * free_scale_.asDiagonal();
  }

  Samples settled_;     // the conditions with loads at the last outer iteration; empty where no effect needs any
  TwistMemory memory_;  // what the effects make of the rows, as they are
  Problem problem_;
  std::optional<LoadResponse> response_;
  const IdentifyOptions& options_;
  std::vector<int> asked_;
  Eigen::VectorXd start_, theta_, scale_, hold_, free_scale_;
  Limits limits_;
  mutable RowMatrixXd left_;  // residuals at left_at_; empty where the loads have moved since
  mutable Eigen::VectorXd left_at_;
  Eigen::MatrixXd factor_;  // of asked_, at factor_at_ and factor_tau_; empty where the loads have moved since
  Eigen::VectorXd factor_at_;
  CommonNoise factor_tau_{};
  CommonNoise tau_{};
  CommonNoise tuned_{};  // the noise before the last step of fine_fit, which leaves the outliers out
  LossKind loss_ = LossKind::kNone;
  Gauge gauge_;
  std::vector<int> free_;
  double numbers_ = 0;
  double freedom_ = 1;
  std::ptrdiff_t kinds_ = 0;
  bool converged_ = false;
  bool claims_ = false;  // do the rows claim a noise of their own?
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

Identification identify(const Problem& problem, const std::vector<int>& asked, const Eigen::Matrix3Xd& anchors,
                        const IdentifyOptions& options) {
  problem.check();
  for (const int index : asked) {
    FASTCAL_CHECK(index >= 0 && index < problem.model.parameter_count())
        << "asked parameters must be 0 to " << problem.model.parameter_count() - 1 << ", got " << index;
  }
  FASTCAL_CHECK(std::set<int>(asked.begin(), asked.end()).size() == asked.size())
      << "asked parameters must differ from each other";
  check_limits(options, problem.parameter_count());
  FASTCAL_CHECK(anchors.allFinite()) << "starting places of anchors must be finite";
  FASTCAL_CHECK(anchors.cols() == problem.measured.anchor_count)
      << "there are " << problem.measured.anchor_count << " anchors, got " << anchors.cols() << " starting places";
  return Identifier(problem, asked, anchors, options).run();
}

}  // namespace fastcal
