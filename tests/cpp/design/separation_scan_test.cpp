// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What a fit leaves, kept up to date, is what least squares leaves; adding and taking away.
#include "fastcal/design/separation_scan.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <random>
#include <set>

namespace fastcal::design {
namespace {

constexpr int kCandidates = 30;
constexpr int kRows = 3;

TEST(SeparationScan, ValueAndGainsAreThoseOfLeastSquares) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const RowMatrixXd X = RowMatrixXd::NullaryExpr(kCandidates * kRows, 6, [&] { return normal(random); });
  const RowMatrixXd u = RowMatrixXd::NullaryExpr(kCandidates * kRows, 2, [&] { return normal(random); });
  const auto left = [&](const std::set<Eigen::Index>& members) {
    std::vector<Eigen::Index> rows;
    for (const Eigen::Index c : members) {
      for (int k = 0; k < kRows; ++k) rows.push_back(c * kRows + k);
    }
    const Eigen::MatrixXd A = X(rows, Eigen::all);
    const Eigen::MatrixXd b = u(rows, Eigen::all);
    return (b - A * A.colPivHouseholderQr().solve(b)).squaredNorm();
  };
  const Candidates candidates(X, kRows);
  SeparationScan scan(candidates, u, {}, 2);
  scan.restart(1e-6 * Eigen::MatrixXd::Identity(6, 6));
  std::set<Eigen::Index> members;
  for (const Eigen::Index c : {4, 29, 11, 7, 0, 18}) {
    scan.add(c);
    members.insert(c);
  }
  for (const Eigen::Index c : {11, 4}) {
    scan.remove(c);
    members.erase(c);
  }
  EXPECT_NEAR(scan.value(), left(members), 1e-4);
  const Eigen::VectorXd gains = scan.gains();
  for (Eigen::Index c = 0; c < kCandidates; ++c) {
    if (members.count(c) > 0) continue;
    std::set<Eigen::Index> more = members;
    more.insert(c);
    EXPECT_NEAR(gains[c], left(more) - left(members), 1e-4);
  }
  std::set<Eigen::Index> fewer = members;
  fewer.erase(29);
  EXPECT_NEAR(scan.gain_of_removing(29), left(fewer) - left(members), 1e-4);
}

}  // namespace
}  // namespace fastcal::design
