// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Deflections that are known in closed form, to 1e-10 of their size.
#include <gtest/gtest.h>

#include <cmath>

#include "structure/solve.hpp"

namespace fastcal::test {
namespace {

constexpr double kTolerance = 1e-10;
constexpr double kG = 9.80665;

void expect_close(double got, double expected) { EXPECT_NEAR(got, expected, kTolerance * std::abs(expected)); }

BeamFrame plane(int nodes, std::vector<BeamElement> elements, std::vector<BeamSupport> supports,
                std::vector<BeamHinge> hinges = {}) {
  return {2, nodes, std::move(elements), std::move(hinges), std::move(supports)};
}

RowMatrixXd no_load(int nodes, int freedoms = 3) { return RowMatrixXd::Zero(nodes, freedoms); }

const Eigen::Vector2d kDown(0, -kG);

TEST(ClosedForms, CantileverWithTipForceMomentAndOwnWeight) {
  const double L = 1.7, P = 420, M = 35;
  const BeamElement e = beam(0, 1);
  const double EI = e.young * e.inertia_z, w = e.mass * kG / L;
  RowMatrixXd nodes(2, 2), load = no_load(2);
  nodes << 0, 0, L, 0;
  load.row(1) << 5000, -P, -M;
  const RowMatrixXd u = solve(plane(2, {e}, {fixed(0, 2)}), nodes, {load, kDown, {}, {}});
  expect_close(u(1, 0), 5000 * L / (e.young * e.area));
  expect_close(u(1, 1), -P * L * L * L / (3 * EI) - M * L * L / (2 * EI) - w * std::pow(L, 4) / (8 * EI));
  expect_close(u(1, 2), -P * L * L / (2 * EI) - M * L / EI - w * std::pow(L, 3) / (6 * EI));
  EXPECT_TRUE(u.row(0).isZero(0));
}

TEST(ClosedForms, TimoshenkoCantileverAddsShear) {
  const double L = 0.4, P = 420;
  BeamElement e = beam(0, 1);
  e.shear_area_y = 1.3e-3;
  const double EI = e.young * e.inertia_z, GA = e.shear * e.shear_area_y, w = e.mass * kG / L;
  RowMatrixXd nodes(2, 2), load = no_load(2);
  nodes << 0, 0, L, 0;
  load(1, 1) = -P;
  const RowMatrixXd u = solve(plane(2, {e}, {fixed(0, 2)}), nodes, {load, kDown, {}, {}});
  expect_close(u(1, 1), -P * (std::pow(L, 3) / (3 * EI) + L / GA) - w * (std::pow(L, 4) / (8 * EI) + L * L / (2 * GA)));
  expect_close(u(1, 2), -P * L * L / (2 * EI) - w * std::pow(L, 3) / (6 * EI));
}

TEST(ClosedForms, SimpleBeamWithPinAndRollerSagsInTheMiddle) {
  const double L = 3.2, P = 900;
  const BeamElement half = beam(0, 1);
  const double EI = half.young * half.inertia_z, w = 2 * half.mass * kG / L;
  RowMatrixXd nodes(3, 2), load = no_load(3);
  nodes << 0, 0, L / 2, 0, L, 0;
  load(1, 1) = -P;
  const RowMatrixXd u = solve(plane(3, {half, beam(1, 2)}, {{0, 3}, {2, 2}}), nodes, {load, kDown, {}, {}});
  expect_close(u(1, 1), -P * std::pow(L, 3) / (48 * EI) - 5 * w * std::pow(L, 4) / (384 * EI));
  expect_close(u(0, 2), -P * L * L / (16 * EI) - w * std::pow(L, 3) / (24 * EI));
  EXPECT_NEAR(u(1, 2), 0, 1e-15);
}

TEST(ClosedForms, ProppedCantileverWithHingedEnd) {
  const double L = 2.0;
  const BeamElement half = beam(0, 1);
  const double EI = half.young * half.inertia_z, w = 2 * half.mass * kG / L;
  RowMatrixXd nodes(3, 2);
  nodes << 0, 0, L / 2, 0, L, 0;
  const BeamFrame frame = plane(3, {half, beam(1, 2)}, {fixed(0, 2), fixed(2, 2)}, {{1, 1, 4}});
  const RowMatrixXd u = solve(frame, nodes, {{}, kDown, {}, {}});
  expect_close(u(1, 1), -w * std::pow(L, 4) / (192 * EI));
}

/// Sway of a portal of columns h and a beam L, H shared by its corners; the columns' axial strain tilts the beam as if
/// its I were smaller: I_b' = I_b / (1 + 24 I_b h / (A_c L^3)).
struct Portal {
  double h = 2.5, L = 3.0, H = 1200;
  BeamElement column = beam(0, 1), girder = beam(1, 2);
  RowMatrixXd nodes = RowMatrixXd(4, 2), load = no_load(4);

  Portal() {
    nodes << 0, 0, 0, h, L, h, L, 0;
    load(1, 0) = load(2, 0) = H / 2;
    girder.inertia_z = 1.9e-5;
  }
  double k() const {
    const double I = girder.inertia_z / (1 + 24 * girder.inertia_z * h / (column.area * L * L * L));
    return I * h / (L * column.inertia_z);
  }
  double unit() const { return H * h * h * h / (12 * column.young * column.inertia_z); }
  RowMatrixXd solve_with(std::vector<BeamHinge> hinges) const {
    const BeamFrame frame = plane(4, {column, girder, beam(3, 2)}, {fixed(0, 2), fixed(3, 2)}, std::move(hinges));
    return solve(frame, nodes, {load, {}, {}, {}});
  }
};

TEST(ClosedForms, PortalWithFixedFeet) {
  const Portal portal;
  const double k = portal.k();
  const RowMatrixXd u = portal.solve_with({});
  expect_close(u(1, 0), portal.unit() * (2 + 3 * k) / (1 + 6 * k));
  expect_close(u(2, 0), u(1, 0));
}

TEST(ClosedForms, PortalWithHingedFeet) {
  const Portal portal;
  const double k = portal.k();
  const RowMatrixXd u = portal.solve_with({{0, 0, 4}, {2, 0, 4}});
  expect_close(u(1, 0), portal.unit() * (1 + 2 * k) / k);
}

TEST(ClosedForms, PortalWithHingedCornersIsTwoCantilevers) {
  const Portal portal;
  const RowMatrixXd u = portal.solve_with({{1, 0, 4}, {1, 1, 4}});
  expect_close(u(1, 0), portal.H / 2 * std::pow(portal.h, 3) / (3 * portal.column.young * portal.column.inertia_z));
}

TEST(ClosedForms, HingedTripodCarriesByAxialForceAndItsApexDoesNotTurn) {
  const double h = 1.2, b = 0.7, P = 5000;
  RowMatrixXd nodes(3, 2), load = no_load(3);
  nodes << -b, 0, b, 0, 0, h;
  load(2, 1) = -P;
  const BeamElement left = beam(0, 2), right = beam(1, 2);
  const BeamFrame frame =
      plane(3, {left, right}, {fixed(0, 2), fixed(1, 2)}, {{0, 0, 4}, {0, 1, 4}, {1, 0, 4}, {1, 1, 4}});
  const RowMatrixXd u = solve(frame, nodes, {load, {}, {}, {}});
  const double length = std::hypot(b, h), sine = h / length;
  expect_close(u(2, 1), -P * length / (2 * left.young * left.area * sine * sine));
  EXPECT_EQ(u(2, 2), 0.0);
}

TEST(ClosedForms, SpaceCantileverBendsInBothPlanesAndTwists) {
  const double L = 1.1;
  BeamElement e = beam(0, 1);
  e.shear_area_y = 1.2e-3;
  e.shear_area_z = 2.1e-3;
  const Eigen::Matrix<double, 6, 1> f = (Eigen::Matrix<double, 6, 1>() << 3000, 200, -300, 40, 25, -15).finished();
  RowMatrixXd nodes(2, 3), load = no_load(2, 6), up(1, 3);
  // Local x along global y, z along global x: y is then along global z.
  nodes << 0, 0, 0, 0, L, 0;
  up << 1, 0, 0;
  Eigen::Matrix3d R;  // columns: local axes
  R.col(0) = Eigen::Vector3d::UnitY();
  R.col(2) = Eigen::Vector3d::UnitX();
  R.col(1) = R.col(2).cross(R.col(0));
  load.row(1).head<3>() = (R * f.head<3>()).transpose();
  load.row(1).tail<3>() = (R * f.tail<3>()).transpose();
  const BeamFrame frame{3, 2, {e}, {}, {fixed(0, 3)}};
  const RowMatrixXd u = solve(frame, nodes, {load, {}, up, {}});
  const Eigen::Vector3d shift = R.transpose() * u.row(1).head<3>().transpose();
  const Eigen::Vector3d turn = R.transpose() * u.row(1).tail<3>().transpose();
  const double EIz = e.young * e.inertia_z, EIy = e.young * e.inertia_y, L2 = L * L, L3 = L2 * L;
  expect_close(shift[0], f[0] * L / (e.young * e.area));
  expect_close(shift[1], f[1] * (L3 / (3 * EIz) + L / (e.shear * e.shear_area_y)) + f[5] * L2 / (2 * EIz));
  expect_close(shift[2], f[2] * (L3 / (3 * EIy) + L / (e.shear * e.shear_area_z)) - f[4] * L2 / (2 * EIy));
  expect_close(turn[0], f[3] * L / (e.shear * e.torsion));
  expect_close(turn[1], f[4] * L / EIy - f[2] * L2 / (2 * EIy));
  expect_close(turn[2], f[5] * L / EIz + f[1] * L2 / (2 * EIz));
}

TEST(ClosedForms, SpaceBeamHingedAboutOneAxisIsProppedInOnePlaneAndClampedInTheOther) {
  const double L = 1.6;
  RowMatrixXd nodes(3, 3), up = RowMatrixXd(2, 3);
  nodes << 0, 0, 0, L / 2, 0, 0, L, 0, 0;
  up << 0, 0, 1, 0, 0, 1;
  const BeamElement half = beam(0, 1);
  const BeamFrame frame{3, 3, {half, beam(1, 2)}, {{1, 1, 4}}, {fixed(0, 3), fixed(2, 3)}};
  const Eigen::Vector3d gravity(0, -3, -7);
  const RowMatrixXd u = solve(frame, nodes, {{}, gravity, up, {}});
  const double w = 2 * half.mass / L;
  expect_close(u(1, 1), -3 * w * std::pow(L, 4) / (192 * half.young * half.inertia_z));
  expect_close(u(1, 2), -7 * w * std::pow(L, 4) / (384 * half.young * half.inertia_y));
}

}  // namespace
}  // namespace fastcal::test
