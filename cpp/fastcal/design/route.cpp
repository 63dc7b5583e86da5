// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/route.hpp"

#include <algorithm>
#include <limits>

#include "fastcal/math/check.hpp"

namespace fastcal::design {
namespace {

constexpr int kMostSweeps = 100;
constexpr double kShorter = 1e-12;

/// Distances between all rows and, as the last row, `from`.
Eigen::MatrixXd distances(const Eigen::Ref<const RowMatrixXd>& q, const Eigen::Ref<const Eigen::VectorXd>& from) {
  FASTCAL_CHECK(from.size() == q.cols()) << "from must have " << q.cols() << " joints, got " << from.size();
  RowMatrixXd all(q.rows() + 1, q.cols());
  all << q, from.transpose();
  Eigen::MatrixXd out(all.rows(), all.rows());
  for (Eigen::Index i = 0; i < all.rows(); ++i) {
    for (Eigen::Index j = 0; j < all.rows(); ++j) out(i, j) = (all.row(i) - all.row(j)).cwiseAbs().maxCoeff();
  }
  return out;
}

std::vector<Eigen::Index> nearest_neighbours(const Eigen::MatrixXd& D) {
  const Eigen::Index n = D.rows() - 1;
  std::vector<bool> seen(static_cast<std::size_t>(n), false);
  std::vector<Eigen::Index> order;
  Eigen::Index at = n;
  for (Eigen::Index step = 0; step < n; ++step) {
    Eigen::Index next = -1;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (!seen[static_cast<std::size_t>(j)] && (next < 0 || D(at, j) < D(at, next))) next = j;
    }
    seen[static_cast<std::size_t>(next)] = true;
    order.push_back(at = next);
  }
  return order;
}

/// Turns stretches of the path around while that shortens it; the first place is fixed, the end is free.
void two_opt(const Eigen::MatrixXd& D, std::vector<Eigen::Index>& order) {
  const auto n = static_cast<std::ptrdiff_t>(order.size());
  const auto at = [&](std::ptrdiff_t i) { return i < 0 ? D.rows() - 1 : order[static_cast<std::size_t>(i)]; };
  bool shorter = true;
  for (int sweep = 0; shorter && sweep < kMostSweeps; ++sweep) {
    shorter = false;
    for (std::ptrdiff_t i = 0; i + 1 < n; ++i) {
      for (std::ptrdiff_t j = i + 1; j < n; ++j) {
        double change = D(at(i - 1), at(j)) - D(at(i - 1), at(i));
        if (j + 1 < n) change += D(at(i), at(j + 1)) - D(at(j), at(j + 1));
        if (change < -kShorter) {
          std::reverse(order.begin() + i, order.begin() + j + 1);
          shorter = true;
        }
      }
    }
  }
}

}  // namespace

std::vector<Eigen::Index> visiting_order(const Eigen::Ref<const RowMatrixXd>& q,
                                         const Eigen::Ref<const Eigen::VectorXd>& from) {
  const Eigen::MatrixXd D = distances(q, from);
  std::vector<Eigen::Index> order = nearest_neighbours(D);
  two_opt(D, order);
  return order;
}

double path_length(const Eigen::Ref<const RowMatrixXd>& q, const Eigen::Ref<const Eigen::VectorXd>& from,
                   const std::vector<Eigen::Index>& order) {
  const Eigen::MatrixXd D = distances(q, from);
  double length = 0;
  Eigen::Index at = q.rows();
  for (const Eigen::Index next : order) {
    length += D(at, next);
    at = next;
  }
  return length;
}

}  // namespace fastcal::design
