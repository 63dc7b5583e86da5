// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/separation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "fastcal/design/separation_scan.hpp"

namespace fastcal::design {
namespace {

constexpr double kWeak = 1e-9;  // of an average candidate's information: keeps directions without any from dividing

/// All pairs of a problem: who is there (i) and who is fitted (j), each with its scan.
class Pairs {
 public:
  Pairs(const SeparationProblem& problem, int threads) : m_(static_cast<Eigen::Index>(problem.causes.size())) {
    first_.push_back(problem.common.cols());
    for (const RowMatrixXd& C : problem.causes) first_.push_back(first_.back() + C.cols());
    rows_.reserve(problem.causes.size());
    for (Eigen::Index fitted = 0; fitted < m_; ++fitted) add_fitted(problem, fitted, threads);
  }

  /// Rows [A, C_j] of a fitted cause, scaled, and their information before any choice.
  const Candidates& rows(Eigen::Index fitted) const { return rows_[static_cast<std::size_t>(fitted)]; }
  const Eigen::MatrixXd& start(Eigen::Index fitted) const { return start_[static_cast<std::size_t>(fitted)]; }

  void add(Eigen::Index candidate) {
    for (Pair& pair : pairs_) pair.scan->add(candidate);
  }

  /// sum log(1 + gain / (1 + D)) of each candidate.
  Eigen::VectorXd gains() const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(rows_.front().count());
    for (const Pair& pair : pairs_) {
      out += (pair.scan->gains() / (1 + std::max(0.0, pair.scan->value()))).array().log1p().matrix();
    }
    return out;
  }

  Eigen::MatrixXd table() const {
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(m_, m_);
    for (const Pair& pair : pairs_) D(pair.present, pair.fitted) = std::max(0.0, pair.scan->value());
    return D;
  }

  double least() const {
    double out = std::numeric_limits<double>::infinity();
    for (const Pair& pair : pairs_) out = std::min(out, pair.scan->value());
    return out;
  }

 private:
  struct Pair {
    Eigen::Index present, fitted;
    std::unique_ptr<Scan> scan;
  };

  void add_fitted(const SeparationProblem& problem, Eigen::Index fitted, int threads) {
    const Eigen::Index common = problem.common.cols();
    const Eigen::Index n = problem.common.rows();
    const RowMatrixXd& C = problem.causes[static_cast<std::size_t>(fitted)];
    const Eigen::Index p = common + C.cols();
    const bool measured = problem.prior.size() > 0;
    RowMatrixXd X(n, p);
    X << problem.common, C;
    std::vector<Eigen::Index> own(static_cast<std::size_t>(p));  // these columns among all
    for (Eigen::Index k = 0; k < p; ++k) {
      own[static_cast<std::size_t>(k)] = k < common ? k : first_[static_cast<std::size_t>(fitted)] + k - common;
    }
    const Eigen::MatrixXd H = measured ? Eigen::MatrixXd(problem.prior(own, own)) : Eigen::MatrixXd::Zero(p, p);
    // The information of an average candidate and the earlier data on a column becomes 1.
    const Eigen::VectorXd square =
        X.colwise().squaredNorm().transpose() * problem.rows / static_cast<double>(n) + H.diagonal();
    const Eigen::VectorXd scale = (square.array() > 0).select(square.cwiseSqrt().cwiseInverse(), 1.0);
    X = X * scale.asDiagonal();
    rows_.emplace_back(X, problem.rows);
    start_.emplace_back(scale.asDiagonal() * H * scale.asDiagonal());
    start_.back().diagonal().array() += kWeak;
    for (Eigen::Index present = 0; present < m_; ++present) {
      if (present == fitted) continue;
      const RowMatrixXd u =
          problem.causes[static_cast<std::size_t>(present)] * problem.expected[static_cast<std::size_t>(present)];
      const Eigen::Index e = u.cols();
      Eigen::MatrixXd earlier = Eigen::MatrixXd::Zero(p + e, p + e);
      if (measured) {
        const auto theirs = Eigen::seqN(first_[static_cast<std::size_t>(present)],
                                        problem.causes[static_cast<std::size_t>(present)].cols());
        const Eigen::MatrixXd& W = problem.expected[static_cast<std::size_t>(present)];
        earlier.topLeftCorner(p, p) = start_.back();
        earlier.topRightCorner(p, e) = scale.asDiagonal() * Eigen::MatrixXd(problem.prior(own, theirs)) * W;
        earlier.bottomLeftCorner(e, p) = earlier.topRightCorner(p, e).transpose();
        earlier.bottomRightCorner(e, e) = W.transpose() * Eigen::MatrixXd(problem.prior(theirs, theirs)) * W;
      }
      pairs_.push_back({present, fitted, std::make_unique<SeparationScan>(rows_.back(), u, earlier, threads)});
      pairs_.back().scan->restart(start_.back());
    }
  }

  Eigen::Index m_;
  std::vector<Eigen::Index> first_;  // column of each cause among [common, causes ...]
  std::vector<Candidates> rows_;
  std::vector<Eigen::MatrixXd> start_;
  std::vector<Pair> pairs_;
};

void check(const SeparationProblem& problem) {
  const Eigen::Index n = problem.common.rows();
  FASTCAL_CHECK(problem.causes.size() >= 2 && problem.expected.size() == problem.causes.size())
      << "there must be two causes or more, and as many sizes, got " << problem.causes.size() << " and "
      << problem.expected.size();
  Eigen::Index all = problem.common.cols();
  for (std::size_t i = 0; i < problem.causes.size(); ++i) {
    const RowMatrixXd& C = problem.causes[i];
    const Eigen::MatrixXd& W = problem.expected[i];
    FASTCAL_CHECK(C.rows() == n && C.cols() > 0 && C.cols() == W.rows() && W.cols() > 0)
        << "cause " << i << " must have " << n << " rows and a size for each column, got (" << C.rows() << ", "
        << C.cols() << ") and " << W.rows();
    FASTCAL_CHECK(W.allFinite()) << "the size of cause " << i << " must be finite";
    all += C.cols();
  }
  FASTCAL_CHECK(problem.prior.size() == 0 ||
                (problem.prior.rows() == all && problem.prior.cols() == all && problem.prior.allFinite()))
      << "earlier information must be finite and have " << all << " rows and columns, got (" << problem.prior.rows()
      << ", " << problem.prior.cols() << ")";
}

}  // namespace

Separation separate(const SeparationProblem& problem, int count, double enough, int threads) {
  check(problem);
  FASTCAL_CHECK(count >= 0) << "count must be at least 0, got " << count;
  Pairs pairs(problem, threads);
  Separation out;
  out.before = pairs.table();
  DeterminantScan blind(pairs.rows(0), threads);
  const Eigen::Index unknowns = problem.prior.size() > 0 ? 0 : pairs.rows(0).columns();
  if (unknowns > 0) blind.restart(pairs.start(0));
  std::vector<bool> taken(static_cast<std::size_t>(blind.candidates().count()), false);
  const std::size_t most = std::min(static_cast<std::size_t>(count), taken.size());
  while (out.chosen.size() < most) {
    const bool is_blind = static_cast<Eigen::Index>(out.chosen.size()) * problem.rows < unknowns;
    if (!is_blind && pairs.least() >= enough) break;
    const Eigen::VectorXd gains = is_blind ? blind.gains() : pairs.gains();
    Eigen::Index best = -1;
    for (Eigen::Index c = 0; c < gains.size(); ++c) {
      if (!taken[static_cast<std::size_t>(c)] && (best < 0 || gains[c] > gains[best])) best = c;
    }
    taken[static_cast<std::size_t>(best)] = true;
    out.chosen.push_back(best);
    pairs.add(best);
    if (is_blind) blind.add(best);
  }
  out.after = pairs.table();
  return out;
}

}  // namespace fastcal::design
