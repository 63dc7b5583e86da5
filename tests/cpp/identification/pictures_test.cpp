// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Sums over rows of pictures, where each camera's corners leave the columns of the other alone, and over rows whose
// unknowns are not those of the rows beside them, against dense ones.
#include <gtest/gtest.h>

#include "fastcal/effects/registry.hpp"
#include "fastcal/identification/linearization.hpp"
#include "support/simulation.hpp"

namespace fastcal {
namespace {

using test::Random;

constexpr int kCorners = 6;

/// A camera on the flange and one in the room, a board in the measuring frame and one on the flange; only the first
/// camera's lens is identified.
Rig rig(Random& random) {
  Rig out;
  Intrinsics lens = Intrinsics::Zero();
  lens.head<6>() << 1400, 1402, 640, 512, -0.11, 0.09;
  out.cameras.push_back({{"wrist", link_frame(5), random.pose(0.1)}, LensModel::kPinhole, lens, 6});
  out.cameras.push_back({{"room", kWorldFrame, random.pose(1)}, LensModel::kPinhole, lens, 0});
  Eigen::Matrix3Xd corners(3, kCorners);
  for (int k = 0; k < kCorners; ++k) corners.col(k) << 0.02 * (k % 3), 0.03 * (k / 3), 0;
  out.boards.push_back({{"plate", kWorldFrame, random.pose(1)}, corners});
  out.boards.push_back({{"tag", link_frame(5), random.pose(0.1)}, corners});
  return out;
}

/// An arm with an effect whose derivatives are remembered, pictures with gaps, and touches of two sockets by turns.
struct Pictures {
  ErrorModel model;
  Samples samples;
  Measurements measured;

  Problem problem(int threads, TwistMemory* memory = nullptr) const {
    return {model, samples, measured, threads, nullptr, memory};
  }
};

Pictures pictures(Eigen::Index rows) {
  Random random(21);
  const RobotModel robot = test::build("dh", test::six_axes(0.7));
  Pictures out{
      ErrorModel(robot, {make_effect("reduction_ratio", robot, "joint2", {})}), test::postures(random, rows, 6), {}};
  RowMatrixXd uv = RowMatrixXd::NullaryExpr(rows, 8 * kCorners, [&] { return random.uniform(0, 1000); });
  for (Eigen::Index i = 0; i < rows; i += 3) uv.row(i).segment(2 * (i % 20), 6).setConstant(std::nan(""));
  uv.middleCols(2 * kCorners, 2 * kCorners).setConstant(std::nan(""));  // the wrist never sees the tag
  Tables tables{rows, {{"corner", uv}}, {}, rig(random)};
  Labels& sockets = tables.labels["socket"];
  sockets.names = {"a", "b"};
  sockets.codes = Eigen::VectorXi::NullaryExpr(rows, [](Eigen::Index i) { return static_cast<int>(i % 2); });
  out.measured = Measurements(tables, robot);
  return out;
}

TEST(Pictures, SumsAreTheDenseOnes) {
  const Pictures s = pictures(70);
  const int p = s.problem(1).parameter_count();
  Random random(3);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(p);
  theta.head(s.model.parameter_count()) = s.model.start();
  theta.tail(s.measured.unknown_count()) = random.values(s.measured.unknown_count(), 0.05);
  const CommonNoise tau{0.5, 1e-3};
  const Linearization all = linearize(s.problem(1), theta, tau);
  std::vector<int> free;
  for (int k = p; k-- > 0;) {
    if (k % 7 != 3) free.push_back(k);  // some are held, in any order
  }
  const auto m = static_cast<Eigen::Index>(free.size());
  const Eigen::VectorXd scale = Eigen::VectorXd::LinSpaced(m, 1e-3, 2e-3);
  const Eigen::MatrixXd J = all.J(Eigen::all, free) * scale.asDiagonal();
  const Eigen::MatrixXd A = J.transpose() * J;
  TwistMemory memory;
  memory.prepare(70);
  for (int pass = 0; pass < 2; ++pass) {
    const NormalEquations found =
        normal_equations(s.problem(1, &memory), theta, free, scale, {tau, LossKind::kNone}, true);
    EXPECT_LT((found.A - A).norm(), 1e-12 * A.norm());
    EXPECT_LT((found.g - J.transpose() * all.r).norm(), 1e-12 * found.g.norm());
    const Eigen::MatrixXd R = triangular_factor(s.problem(1, &memory), theta, free, scale, {tau});
    EXPECT_LT((R.transpose() * R - A).norm(), 1e-12 * A.norm());
  }
}

TEST(Pictures, SumsAreTheSameBitsWhateverTheThreads) {
  const Pictures s = pictures(2100);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(s.problem(1).parameter_count());
  theta.head(s.model.parameter_count()) = s.model.start();
  std::vector<int> free;
  for (int k = 0; k < theta.size(); ++k) free.push_back(k);
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(theta.size(), 1e-3);
  const Weighting weighting{{0.5, 1e-3}, LossKind::kTukey};
  const NormalEquations one = normal_equations(s.problem(1), theta, free, scale, weighting, true);
  const NormalEquations two = normal_equations(s.problem(2), theta, free, scale, weighting, true);
  EXPECT_EQ(one.A, two.A);
  EXPECT_EQ(one.g, two.g);
}

}  // namespace
}  // namespace fastcal
