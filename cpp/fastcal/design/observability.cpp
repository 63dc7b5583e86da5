// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/observability.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/decompositions.hpp"

namespace fastcal::design {
namespace {

constexpr Eigen::Index kTried = 8;     // candidates that are judged exactly in place of a member
constexpr Eigen::Index kListed = 500;  // candidates of a round: their scores are formed again after each exchange
constexpr double kRounding = 1e-10;

/// Columns V (p, p) with first-order gain |J_c V_+|^2 - |J_c V_-|^2; the last column is V_-.
///
/// d lambda_i = |J_c v_i|^2 for an eigenvector v_i. Where the index looks at the least eigenvalue alone, its neighbours
/// take part with the fourth power of their closeness: raised alone, it would soon be passed by the next.
Eigen::MatrixXd ascent(ObservabilityIndex index, const Eigen::MatrixXd& M) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(M);
  const Eigen::VectorXd lambda = eigen.eigenvalues().cwiseMax(1e-12 * eigen.eigenvalues().maxCoeff());
  const Eigen::Index p = lambda.size();
  Eigen::VectorXd weight(p);
  double falling = 0;  // weight of the largest eigenvalue where it should not rise
  switch (index) {
    case ObservabilityIndex::kO1:
      weight = lambda.cwiseInverse();
      break;
    case ObservabilityIndex::kO5:
      weight = lambda.array().pow(-1.5) / lambda.array().rsqrt().sum();
      break;
    default:
      weight = (lambda[0] / lambda.array()).pow(4);
      weight /= weight.sum() * lambda[0];
      if (index == ObservabilityIndex::kO2) falling = 1 / lambda[p - 1];
      if (index == ObservabilityIndex::kO4) falling = 0.5 / lambda[p - 1];
  }
  Eigen::MatrixXd V(p, p + 1);
  V.leftCols(p) = eigen.eigenvectors() * weight.cwiseSqrt().asDiagonal();
  V.col(p) = eigen.eigenvectors().col(p - 1) * std::sqrt(falling);
  return V;
}

Eigen::VectorXd scores(const Candidates& candidates, const Eigen::MatrixXd& V, int threads) {
  Eigen::VectorXd out(candidates.count());
  const auto columns = static_cast<int>(V.cols());
  candidates.multiply(V, threads, [&](Eigen::Index block, const Lane* X) {
    Lane sum{};
    for (int row = 0; row < candidates.rows(); ++row) {
      const Lane* x = X + row * columns;
      for (int m = 0; m < columns - 1; ++m) sum += x[m] * x[m];
      sum -= x[columns - 1] * x[columns - 1];
    }
    for (Eigen::Index lane = 0; lane < kLanes && block * kLanes + lane < candidates.count(); ++lane) {
      out[block * kLanes + lane] = sum[lane];
    }
  });
  return out;
}

/// A design that knows its information matrix and its value.
class Design {
 public:
  Design(ObservabilityIndex index, const Candidates& candidates, const Eigen::MatrixXd& start,
         const std::vector<Eigen::Index>& members)
      : index_(index), candidates_(candidates), poses_(static_cast<Eigen::Index>(members.size())) {
    M_ = start + candidates.information(members);
    value_ = worth(M_);
  }

  const Eigen::MatrixXd& information() const { return M_; }
  double value() const { return value_; }

  /// Puts the best of `tried` in the place of `member` if that is better; returns who is there afterwards.
  Eigen::Index exchange(Eigen::Index member, const std::vector<Eigen::Index>& tried) {
    const Eigen::MatrixXd without = M_ - candidates_.information({member});
    Eigen::Index best = member;
    for (const Eigen::Index c : tried) {
      const Eigen::MatrixXd M = without + candidates_.information({c});
      const double value = worth(M);
      if (value > value_ * (1 + kRounding)) {
        best = c;
        value_ = value;
        M_ = M;
      }
    }
    return best;
  }

 private:
  double worth(const Eigen::MatrixXd& M) const {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(M, Eigen::EigenvaluesOnly);
    return observability(index_, eigen.eigenvalues(), poses_);
  }

  ObservabilityIndex index_;
  const Candidates& candidates_;
  Eigen::Index poses_;
  Eigen::MatrixXd M_;
  double value_ = 0;
};

/// The kTried candidates of a list that gain most to first order and are no members.
std::vector<Eigen::Index> most_promising(ObservabilityIndex index, const Candidates& few, const Eigen::MatrixXd& M,
                                         const std::vector<Eigen::Index>& listed,
                                         const std::vector<Eigen::Index>& members) {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  Eigen::VectorXd promise = scores(few, ascent(index, M), 1);
  for (const Eigen::Index member : members) {
    promise[std::lower_bound(listed.begin(), listed.end(), member) - listed.begin()] = kNever;
  }
  std::vector<Eigen::Index> out;
  for (const Eigen::Index place : best_of(promise, kTried, {})) {
    if (promise[place] > kNever) out.push_back(listed[static_cast<std::size_t>(place)]);
  }
  return out;
}

}  // namespace

double observability(ObservabilityIndex index, const Eigen::VectorXd& eigenvalues, Eigen::Index poses) {
  const Eigen::VectorXd s = eigenvalues.cwiseMax(0).cwiseSqrt();
  const Eigen::Index p = s.size();
  const double least = s[0];
  const double most = s[p - 1];
  if (!(least > 0)) return 0;
  switch (index) {
    case ObservabilityIndex::kO1:
      return std::exp(s.array().log().mean()) / std::sqrt(static_cast<double>(poses));
    case ObservabilityIndex::kO2:
      return least / most;
    case ObservabilityIndex::kO3:
      return least;
    case ObservabilityIndex::kO4:
      return least * least / most;
    default:
      return 1 / s.cwiseInverse().sum();
  }
}

Choice improve_observability(ObservabilityIndex index, const Candidates& candidates, const Eigen::MatrixXd& start,
                             std::vector<Eigen::Index> members, int threads, const SearchOptions& options) {
  FASTCAL_CHECK(!members.empty()) << "there must be members to exchange";
  double value = 0;
  for (int round = 0; round < options.most_rounds; ++round) {
    Design design(index, candidates, start, members);
    const double before = value = design.value();
    const std::vector<Eigen::Index> listed = best_of(scores(candidates, ascent(index, design.information()), threads),
                                                     std::min(options.shortlist, kListed), members);
    const Candidates few = candidates.subset(listed);
    std::vector<Eigen::Index> tried;
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (tried.empty()) tried = most_promising(index, few, design.information(), listed, members);
      const Eigen::Index there = design.exchange(members[i], tried);
      if (there != members[i]) tried.clear();
      members[i] = there;
    }
    value = design.value();
    if (value - before <= options.tolerance * value) break;
  }
  return {members, value, std::numeric_limits<double>::infinity()};
}

}  // namespace fastcal::design
