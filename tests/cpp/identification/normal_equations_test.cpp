// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Normal equations and the triangular factor against plain, dense sums and differences of the cost.
#include <gtest/gtest.h>

#include "fastcal/identification/row_errors.hpp"
#include "fastcal/model/prediction.hpp"
#include "identification/fixed_scene.hpp"

namespace fastcal {
namespace {

using test::Fixed;
using test::fixed;
using test::kTau;
using test::moved;
using test::Random;
using test::What;

// A row at a time, weights from its own length, J from the public parameter_jacobian.
TEST(NormalEquations, AreTheDenseOnes) {
  Fixed s = fixed(1, What::kPoses, 700);
  s.measured.position(3, 1) = std::nan("");
  s.measured.rotation.row(4).setConstant(std::nan(""));
  s.measured.position.row(5).setConstant(std::nan(""));
  s.measured.rotation.row(5).setConstant(std::nan(""));
  Random random(2);
  s.measured.sigma_position = RowMatrixXd::NullaryExpr(700, 3, [&] { return random.uniform(1e-5, 1e-3); });
  const int p = s.model.parameter_count();
  std::vector<double> J_all(static_cast<std::size_t>(700 * 6 * p));
  const Eigen::VectorXd theta = s.model.start();
  parameter_jacobian(s.model, s.samples, theta, 6, 1, J_all.data());
  const auto m = static_cast<Eigen::Index>(s.free.size());
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kTukey, LossKind::kDistance}) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(m, m);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(m);
    double cost = 0;
    RowEvaluator rows(s.model, theta);
    for (Eigen::Index i = 0; i < 700; ++i) {
      const Pose T = rows.pose(s.samples.row(i));
      const Eigen::Map<const RowMatrixXd> J_tool(&J_all[static_cast<std::size_t>(6 * i * p)], 6, p);
      double squared = 0;
      int d = 0;
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, m);
      Eigen::VectorXd r = Eigen::VectorXd::Zero(6);
      for (int c = 0; c < 3; ++c) {
        if (std::isnan(s.measured.position(i, c))) continue;
        const double sigma = std::hypot(s.measured.sigma_position(i, c), kTau[0]);
        for (Eigen::Index k = 0; k < m; ++k) J(c, k) = J_tool(c, s.free[k]) * s.scale[k] / sigma;
        r[c] = (T.p[c] - s.measured.position(i, c)) / sigma;
        ++d;
      }
      if (!s.measured.rotation.row(i).hasNaN()) {
        const Eigen::Matrix3d R_measured = quaternion_to_rotation(s.measured.rotation.row(i).transpose());
        const Eigen::Vector3d turn = log_so3(R_measured.transpose() * T.R);
        const Eigen::Matrix3d slope = right_jacobian_inverse_so3(turn) * T.R.transpose();
        for (Eigen::Index k = 0; k < m; ++k)
          J.col(k).tail<3>() = slope * J_tool.col(s.free[k]).tail<3>() * s.scale[k] / kTau[1];
        r.tail<3>() = turn / kTau[1];
        d += 3;
      }
      squared = r.squaredNorm();
      if (d == 0) continue;
      const Loss& loss = tuned_loss(kind, d);
      A += loss.weight(squared) * J.transpose() * J;
      g += loss.weight(squared) * J.transpose() * r;
      cost += loss.rho(squared) / 2;
    }
    const NormalEquations found = normal_equations(s.problem(), theta, s.free, s.scale, {kTau, kind}, true);
    EXPECT_LT((found.A - A).norm(), 1e-12 * A.norm());
    EXPECT_LT((found.g - g).norm(), 1e-12 * g.norm());
    EXPECT_NEAR(found.cost, cost, 1e-12 * cost);
    EXPECT_NEAR(normal_equations(s.problem(), theta, s.free, s.scale, {kTau, kind}, false).cost, cost, 1e-12 * cost);
  }
}

TEST(NormalEquations, AreTheSameBitsWhateverTheThreads) {
  const Fixed s = fixed(3, What::kPoses, 1500);
  const NormalEquations one =
      normal_equations(s.problem(1), s.model.start(), s.free, s.scale, {kTau, LossKind::kTukey}, true);
  const Eigen::MatrixXd R = triangular_factor(s.problem(1), s.model.start(), s.free, s.scale, {kTau});
  for (const int threads : {2, 5}) {
    const NormalEquations other =
        normal_equations(s.problem(threads), s.model.start(), s.free, s.scale, {kTau, LossKind::kTukey}, true);
    EXPECT_EQ(one.A, other.A);
    EXPECT_EQ(one.g, other.g);
    EXPECT_EQ(one.cost, other.cost);
    EXPECT_EQ(R, triangular_factor(s.problem(threads), s.model.start(), s.free, s.scale, {kTau}));
  }
}

TEST(NormalEquations, GradientIsThatOfTheCostWithLengthsAndAnchorsToo) {
  Random random(4);
  Fixed s = fixed(4, What::kPositions, 40);
  s.measured.position.topRows(20).setConstant(std::nan(""));
  s.measured.distance = Eigen::VectorXd::Constant(40, std::nan(""));
  s.measured.distance.head(30).setConstant(2.2);
  s.measured.anchor = Eigen::VectorXi::NullaryExpr(40, [](Eigen::Index i) { return static_cast<int>(i % 2); });
  s.measured.anchor_count = 2;
  const int p = s.model.parameter_count();
  for (int k = 0; k < 6; ++k) s.free.push_back(p + k);
  s.scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(s.free.size()), 1e-3);
  Eigen::VectorXd theta(p + 6);
  theta << s.model.start(), random.values(6, 2);
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey}) {
    const CommonNoise tau{0.3, 0.3, 0.3};
    const NormalEquations found = normal_equations(s.problem(), theta, s.free, s.scale, {tau, kind}, true);
    for (std::size_t k = 0; k < s.free.size(); ++k) {
      const auto cost = [&](double step) {
        Eigen::VectorXd there = theta;
        there[s.free[k]] += step;
        return normal_equations(s.problem(), there, s.free, s.scale, {tau, kind}, false).cost;
      };
      constexpr double h = 1e-4;
      const double slope = (8 * (cost(h) - cost(-h)) - (cost(2 * h) - cost(-2 * h))) / (12 * h);
      EXPECT_NEAR(found.g[static_cast<Eigen::Index>(k)], 1e-3 * slope, 1e-9 * (1 + std::abs(slope))) << k;
    }
  }
}

// The part of the second derivatives of the geometry is as small as the residuals beside the arm.
TEST(NormalEquations, TheHessianOfARobustCostIsTheSlopeOfItsGradient) {
  Fixed s = fixed(8, What::kPositions, 500);
  Random random(8);
  for (Eigen::Index i = 0; i < 500; ++i) s.measured.position.row(i) += random.normals(1e-4).transpose();
  for (Eigen::Index i = 0; i < 500; i += 10) s.measured.position(i, i % 3) += 3.5e-4;  // on the way out
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey}) {
    const Weighting weighting{kTau, kind};
    const auto g = [&](const Eigen::VectorXd& theta) -> Eigen::VectorXd {
      return normal_equations(s.problem(), theta, s.free, s.scale, weighting, true).g;
    };
    const NormalEquations here = normal_equations(s.problem(), s.truth, s.free, s.scale, weighting, true);
    EXPECT_EQ(here.flattening.size() == 0, kind == LossKind::kNone);
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(s.truth.size());
    for (std::size_t k = 0; k < s.free.size(); ++k) direction[s.free[k]] = s.scale[static_cast<Eigen::Index>(k)];
    constexpr double h = 1e-5;
    const Eigen::VectorXd found = (g(s.truth + h * direction) - g(s.truth - h * direction)) / (2 * h);
    Eigen::MatrixXd H = here.A;
    if (here.flattening.size() > 0) H -= here.flattening;
    const Eigen::VectorXd wanted = H.rowwise().sum();
    EXPECT_LT((found - wanted).norm(), 2e-3 * wanted.norm()) << loss_name(kind);
    if (kind == LossKind::kTukey) {
      EXPECT_GT((here.A.rowwise().sum() - found).norm(), 0.05 * found.norm());
    }
  }
}

TEST(NormalEquations, TheCostIsThatOfTheResiduals) {
  const Fixed s = fixed(5, What::kPoses, 300);
  for (const LossKind kind : {LossKind::kNone, LossKind::kHuber, LossKind::kTukey}) {
    const Weighting weighting{kTau, kind};
    const double cost = normal_equations(s.problem(), s.model.start(), s.free, s.scale, weighting, false).cost;
    EXPECT_NEAR(RowErrors(s.problem(), s.model.start()).cost(weighting), cost, 1e-12 * cost);
  }
}

TEST(TriangularFactor, IsARootOfTheNormalEquations) {
  const Fixed s = fixed(5, What::kPoses, 600);
  const NormalEquations sums = normal_equations(s.problem(), s.truth, s.free, s.scale, {kTau, LossKind::kNone}, true);
  const Eigen::MatrixXd R = triangular_factor(s.problem(), s.truth, s.free, s.scale, {kTau});
  EXPECT_LT((R.transpose() * R - sums.A).norm(), 1e-12 * sums.A.norm());
  EXPECT_TRUE(R.isUpperTriangular());
}

TEST(TriangularFactor, HasTheSlopeOfTheCostInTheSamePass) {
  Fixed s = fixed(5, What::kPoses, 1300);
  s.truth[s.free[0]] += 1e-4;
  s.measured.position.row(700).setConstant(std::nan(""));
  for (const LossKind kind : {LossKind::kNone, LossKind::kTukey}) {
    const NormalEquations sums = normal_equations(s.problem(), s.truth, s.free, s.scale, {kTau, kind}, true);
    Eigen::VectorXd g;
    const Eigen::MatrixXd R = triangular_factor(s.problem(), s.truth, s.free, s.scale, {kTau, kind}, &g);
    EXPECT_EQ(R, triangular_factor(s.problem(), s.truth, s.free, s.scale, {kTau}));
    EXPECT_LT((g - sums.g).norm(), 1e-12 * sums.g.norm());
  }
}

}  // namespace
}  // namespace fastcal
