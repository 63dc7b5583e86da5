// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What holds for every linear frame: reciprocity, energy, symmetry under rigid motions, the same answer from finer
// elements; and that batches, threads and derivatives are right.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "structure/solve.hpp"

namespace fastcal::test {
namespace {

/// A robot-like frame: a post, a parallelogram (nodes 2 3 4 5) with three hinges, a forearm of three elements.
BeamFrame arm(int dimension) {
  BeamFrame frame;
  frame.dimension = dimension;
  frame.node_count = 10;
  const std::vector<std::pair<int, int>> pairs = {{0, 1}, {1, 2}, {2, 3}, {2, 4}, {5, 3},
                                                  {4, 5}, {5, 6}, {6, 7}, {7, 8}, {8, 9}};
  for (const auto& [start, end] : pairs) frame.elements.push_back(beam(start, end));
  frame.elements[3].shear_area_y = frame.elements[3].shear_area_z = 1e-3;
  frame.hinges = {{3, 0, 4}, {5, 0, 4}, {5, 1, 4}};
  frame.supports = {fixed(0, dimension)};
  return frame;
}

RowMatrixXd random_matrix(std::mt19937& random, Eigen::Index rows, Eigen::Index columns, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  return RowMatrixXd::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

RowMatrixXd arm_nodes(std::mt19937& random, int dimension) {
  RowMatrixXd nodes = RowMatrixXd::Zero(10, 3);
  nodes.leftCols<2>() << 0, 0, 0, 0.6, 0.3, 0.9, 1.1, 2.3, -0.1, 1.0, 0.7, 2.4, 1.0, 2.6, 1.7, 2.5, 2.6, 2.4, 2.8, 2.3;
  nodes += random_matrix(random, 10, 3, 0.05);
  return nodes.leftCols(dimension);
}

RowMatrixXd random_up(std::mt19937& random) {
  return random_matrix(random, 10, 3, 0.3).rowwise() + Eigen::RowVector3d(0, 0, 1);
}

class Properties : public testing::TestWithParam<int> {
 protected:
  int D = GetParam(), B = D == 2 ? 3 : 6;
  std::mt19937 random{7};
  BeamFrame frame = arm(D);
  RowMatrixXd nodes = arm_nodes(random, D);
  RowMatrixXd up = D == 3 ? random_up(random) : RowMatrixXd();
  RowMatrixXd load = random_matrix(random, 10, B, 500);
  Eigen::VectorXd gravity = random_matrix(random, D, 1, 9).col(0);
};

INSTANTIATE_TEST_SUITE_P(PlaneAndSpace, Properties, testing::Values(2, 3));

TEST_P(Properties, LoadsAreReciprocal) {
  const RowMatrixXd other = random_matrix(random, 10, B, 500);
  const RowMatrixXd u = solve(frame, nodes, {load, {}, up, {}}), v = solve(frame, nodes, {other, {}, up, {}});
  const double work = u.cwiseProduct(other).sum();
  EXPECT_NEAR(work, v.cwiseProduct(load).sum(), 1e-11 * u.norm() * other.norm());
}

/// dU/ds of the energy U = f.u/2 by an element's stiffness factor is minus that element's strain energy: the sum over
/// the elements is all of it (U is homogeneous of degree -1 in the factors).
TEST_P(Properties, WorkOfTheLoadsIsTheEnergyOfTheElements) {
  const double work = solve(frame, nodes, {load, {}, up, {}}).cwiseProduct(load).sum();
  double sum = 0;
  for (std::size_t e = 0; e < frame.elements.size(); ++e) {
    const double h = 1e-4;
    std::vector<double> more(10, 1.0), less(10, 1.0);
    more[e] += h;
    less[e] -= h;
    const double change =
        (solve(frame, nodes, {load, {}, up, {}}, more) - solve(frame, nodes, {load, {}, up, {}}, less))
            .cwiseProduct(load)
            .sum() /
        (2 * h);
    EXPECT_LT(change, 1e-12 * work);
    sum -= change;
  }
  EXPECT_NEAR(sum, work, 1e-7 * work);
}

TEST_P(Properties, ARigidMotionTurnsDisplacementsWithTheFrame) {
  Eigen::MatrixXd R = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.4).normalized().toRotationMatrix();
  if (D == 2) R = Eigen::Rotation2Dd(0.83).toRotationMatrix();
  const auto turned = [&](const RowMatrixXd& vectors) { return RowMatrixXd(vectors * R.transpose()); };
  const RowMatrixXd moved = turned(nodes).rowwise() + Eigen::RowVectorXd::Constant(D, 3.7);
  RowMatrixXd moved_load = load;
  moved_load.leftCols(D) = turned(load.leftCols(D));
  if (D == 3) moved_load.rightCols(3) = turned(load.rightCols(3));
  const RowMatrixXd u = solve(frame, nodes, {load, gravity, up, {}});
  const RowMatrixXd v = solve(frame, moved, {moved_load, R * gravity, D == 3 ? turned(up) : up, {}});
  RowMatrixXd expected = u;
  expected.leftCols(D) = turned(u.leftCols(D));
  if (D == 3) expected.rightCols(3) = turned(u.rightCols(3));
  EXPECT_LT((v - expected).cwiseAbs().maxCoeff(), 1e-10 * u.cwiseAbs().maxCoeff());
}

TEST_P(Properties, TurningAnElementRoundChangesNothing) {
  BeamFrame other = frame;
  std::swap(other.elements[3].start, other.elements[3].end);
  other.hinges[0].end = 1;
  const Loads loads{load, gravity, up, {}};
  const RowMatrixXd u = solve(frame, nodes, loads);
  EXPECT_LT((solve(other, nodes, loads) - u).cwiseAbs().maxCoeff(), 1e-11 * u.cwiseAbs().maxCoeff());
}

TEST_P(Properties, HalvedElementsGiveTheSameNodes) {
  BeamFrame fine = frame;
  fine.node_count = 20;
  RowMatrixXd fine_nodes(20, D), fine_up = D == 3 ? RowMatrixXd(20, 3) : RowMatrixXd();
  RowMatrixXd fine_load = RowMatrixXd::Zero(20, B);
  fine_nodes.topRows(10) = nodes;
  fine_load.topRows(10) = load;
  if (D == 3) fine_up << up, up;
  for (int e = 0; e < 10; ++e) {
    BeamElement& first = fine.elements[static_cast<std::size_t>(e)];
    first.mass /= 2;
    BeamElement second = first;
    second.start = 10 + e;
    fine_nodes.row(10 + e) = (nodes.row(first.start) + nodes.row(first.end)) / 2;
    first.end = 10 + e;
    fine.elements.push_back(second);
  }
  for (BeamHinge& hinge : fine.hinges) hinge.element += hinge.end == 1 ? 10 : 0;
  const RowMatrixXd u = solve(frame, nodes, {load, gravity, up, {}});
  const RowMatrixXd v = solve(fine, fine_nodes, {fine_load, gravity, fine_up, {}});
  EXPECT_LT((v.topRows(10) - u).cwiseAbs().maxCoeff(), 1e-9 * u.cwiseAbs().maxCoeff());
}

TEST_P(Properties, ASampledElementWithItsSectionsNumbersIsThatElement) {
  const double L = (nodes.row(8) - nodes.row(7)).norm();
  BeamElement& e = frame.elements[8];
  const double EA = e.young * e.area / L, Iz = e.young * e.inertia_z, Iy = e.young * e.inertia_y;
  RowMatrixXd K = RowMatrixXd::Zero(B, B);
  K(0, 0) = EA;
  K(1, 1) = 12 * Iz / (L * L * L);
  K(B - 1, B - 1) = 4 * Iz / L;
  K(1, B - 1) = K(B - 1, 1) = -6 * Iz / (L * L);
  if (D == 3) {
    K(2, 2) = 12 * Iy / (L * L * L);
    K(4, 4) = 4 * Iy / L;
    K(2, 4) = K(4, 2) = 6 * Iy / (L * L);
    K(3, 3) = e.shear * e.torsion / L;
  }
  const RowMatrixXd u = solve(frame, nodes, {load, gravity, up, {}});
  BeamFrame sampled = frame;
  sampled.elements[8].sampled = true;
  EXPECT_LT((solve(sampled, nodes, {load, gravity, up, K}) - u).cwiseAbs().maxCoeff(), 1e-11 * u.cwiseAbs().maxCoeff());
}

TEST_P(Properties, BatchesAndThreadsGiveTheBitsOfOnePosture) {
  const int N = 1023;
  RowMatrixXd all(N * 10, D), shifted((N - 1) * 10, D);
  for (int i = 0; i < N; ++i) all.middleRows(10 * i, 10) = arm_nodes(random, D);
  const BeamSolver solver(frame);
  BeamPostures postures;
  postures.gravity = {gravity.data(), 0};
  postures.load = {load.data(), 0};
  if (D == 3) postures.up = {up.data(), 0};
  const auto run = [&](const double* data, int count, int threads) {
    RowMatrixXd u(count * 10, B);
    postures.nodes = data;
    postures.count = count;
    solver.solve(postures, {}, threads, u.data());
    return u;
  };
  const RowMatrixXd one = run(all.data(), N, 1);
  EXPECT_EQ(run(all.data(), N, 3), one);
  EXPECT_EQ(run(all.data() + 10 * D, N - 1, 1), one.bottomRows((N - 1) * 10));
}

TEST_P(Properties, DerivativesByStiffnessFactorsAreDifferences) {
  const std::vector<int> group = {-1, 0, 1, 1, 1, 1, -1, 2, 2, 0};
  const std::vector<double> scale = {1, 0.8, 1.3, 1, 1, 0.7, 1, 1, 2, 1};
  BeamPostures postures;
  postures.count = 1;
  postures.nodes = nodes.data();
  postures.gravity = {gravity.data(), 0};
  postures.load = {load.data(), 0};
  if (D == 3) postures.up = {up.data(), 0};
  RowMatrixXd u(10, B), du(10 * B, 3);
  BeamSolver(frame).solve_with_derivative(postures, scale, group, 3, 1, u.data(), du.data());
  EXPECT_EQ(u, solve(frame, nodes, {load, gravity, up, {}}, scale));
  for (int column = 0; column < 3; ++column) {
    const auto at = [&](double factor) {
      std::vector<double> scaled = scale;
      for (std::size_t e = 0; e < group.size(); ++e) scaled[e] *= group[e] == column ? factor : 1;
      return solve(frame, nodes, {load, gravity, up, {}}, scaled);
    };
    const double h = 1e-2;  // fourth-order differences: their error is about h^4, rounding's 1e-12 / h
    const RowMatrixXd difference = (8 * (at(1 + h) - at(1 - h)) - (at(1 + 2 * h) - at(1 - 2 * h))) / (12 * h);
    const Eigen::Map<const Eigen::VectorXd> expected(difference.data(), difference.size());
    EXPECT_LT((du.col(column) - expected).cwiseAbs().maxCoeff(), 1e-7 * u.cwiseAbs().maxCoeff()) << column;
  }
}

}  // namespace
}  // namespace fastcal::test
