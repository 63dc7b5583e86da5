// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Single steps of an identification.
#include "fastcal/identification/fit_state.hpp"

#include <gtest/gtest.h>

#include "fastcal/identification/gauge.hpp"
#include "fastcal/identification/robust_noise.hpp"
#include "identification/scene.hpp"

namespace fastcal::test {
namespace {

/// At the nominal arm, with the noise that is there.
void start(FitState& fit) {
  fit.bring_to_equilibrium();
  keep_rows(fit, {});
  fit.tau = {5e-5};
}

// Priors far from the truth, as strong as the data: their cost is most of what a step gains or loses.
TEST(FitState, AStepIsJudgedWithThePriorsWhereItEnds) {
  const Scene s = scene(51, What::kPositions, 60, {5e-5, 0});
  IdentifyOptions options = with(LossKind::kNone);
  options.limits.prior_mean = s.model.start().array() + 2e-3;
  options.limits.prior_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), 2e-5);
  const Problem problem{s.model, s.samples, s.measured};
  FitState fit(problem, asked(s.model, s.what), Eigen::VectorXd(), options);
  start(fit);
  const Stepped first = fit.step(LossKind::kNone, fit.asked, fit.scale, options.limits);
  ASSERT_TRUE(first.is_good);
  const Stepped second = fit.step(LossKind::kNone, fit.asked, fit.scale, options.limits);
  ASSERT_TRUE(second.is_good);
  EXPECT_LT(second.rest, 0.1);
}

// tr(A (A + P)^-1) by the solver's sums is |J R^-1|^2 by the factor, from priors that say nothing to those that say
// all.
TEST(FitState, EffectiveParametersAreTheSameByTheSolversSums) {
  const Scene s = scene(54, What::kPositions, 60, {5e-5, 0});
  const Problem problem{s.model, s.samples, s.measured};
  double before = kInfinite;
  for (const double sigma : {1e-1, 1e-3, 1e-4, 1e-5, 1e-8}) {
    IdentifyOptions options = with(LossKind::kNone);
    options.limits.prior_mean = s.model.start();
    options.limits.prior_sigma = Eigen::VectorXd::Constant(s.model.parameter_count(), sigma);
    options.limits.prior_sigma[0] = kInfinite;
    FitState fit(problem, asked(s.model, s.what), Eigen::VectorXd(), options);
    start(fit);
    choose_free(fit);
    const Eigen::MatrixXd A =
        normal_equations(problem, fit.theta, fit.free, fit.free_scale, {fit.tau, LossKind::kNone}, true).A;
    const double effective = effective_parameters(fit);
    EXPECT_NEAR(effective_parameters(fit, A), effective, 1e-6 * static_cast<double>(fit.free.size()));
    EXPECT_LT(effective, before);
    before = effective;
  }
  EXPECT_NEAR(before, 1, 0.01);  // the one without a prior
}

TEST(FitState, WithinBoundsNoStepIsTaken) {
  const Scene s = scene(52, What::kPositions, 60, {5e-5, 0});
  IdentifyOptions options = with(LossKind::kNone);
  options.limits.lower = Eigen::VectorXd::Constant(s.model.parameter_count(), -kInfinite);
  options.limits.upper = Eigen::VectorXd::Constant(s.model.parameter_count(), kInfinite);
  const Problem problem{s.model, s.samples, s.measured};
  FitState fit(problem, asked(s.model, s.what), Eigen::VectorXd(), options);
  start(fit);
  const Eigen::VectorXd before = fit.theta;
  EXPECT_FALSE(fit.step(LossKind::kNone, fit.asked, fit.scale, options.limits).is_good);
  EXPECT_EQ(fit.theta, before);
}

TEST(FitState, TheLastStepIsTakenOnlyFromNearTheMinimum) {
  for (const Eigen::Index rows : {60, 1200}) {
    const Scene s = scene(53, What::kPositions, rows, {5e-5, 0});
    const IdentifyOptions options = with(LossKind::kNone);
    const Problem problem{s.model, s.samples, s.measured};
    FitState fit(problem, asked(s.model, s.what), Eigen::VectorXd(), options);
    start(fit);
    choose_free(fit);
    const Stepped first = fit.step(LossKind::kNone, fit.free, fit.free_scale, options.limits);
    ASSERT_TRUE(first.is_good);
    const Eigen::VectorXd far = fit.theta;
    EXPECT_FALSE(fit.step_with_factor(false));
    EXPECT_EQ(fit.theta, far);
    ASSERT_TRUE(fit.step(LossKind::kNone, fit.free, fit.free_scale, options.limits).is_good);
    ASSERT_TRUE(fit.step_with_factor(false));
    EXPECT_EQ(fit.all_agree(), rows > 1000);
    // The factor, found by sums of all rows or by a QR, is that of the free columns.
    const Eigen::MatrixXd R = triangular_factor(problem, fit.theta, fit.free, fit.free_scale, {fit.tau});
    const Eigen::MatrixXd found = fit.free_factor();
    EXPECT_TRUE(found.transpose().isUpperTriangular(0));
    EXPECT_LT((found.transpose() * found - R.transpose() * R).norm(), 1e-6 * (R.transpose() * R).norm());
  }
}

TEST(FitState, TheGaugeIsConfirmedWhereItHoldsAndLeftOpenElsewhere) {
  const Scene s = scene(54, What::kPositions, 60, {5e-5, 0});
  const IdentifyOptions options = with(LossKind::kNone);
  const Problem problem{s.model, s.samples, s.measured};
  FitState fit(problem, asked(s.model, s.what), Eigen::VectorXd(), options);
  start(fit);
  EXPECT_FALSE(fit.confirms_gauge(fit.theta)) << "none is chosen";
  choose_free(fit);
  EXPECT_EQ(choose_gauge(fit.gauge_factor(fit.theta), fit.hold).free, fit.gauge.free);
  EXPECT_FALSE(fit.confirms_gauge(fit.theta)) << "the factor is from before the gauge";
  fit.forget();
  EXPECT_TRUE(fit.confirms_gauge(fit.theta));
  fit.gauge.free.push_back(fit.gauge.held.back());
  fit.gauge.held.pop_back();
  fit.forget();
  EXPECT_FALSE(fit.confirms_gauge(fit.theta)) << "one more is free than the data fix";
}

}  // namespace
}  // namespace fastcal::test
