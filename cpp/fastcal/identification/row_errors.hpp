// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What a fit leaves of every row, as far as noise, costs and weights need to know it: ten bytes a row and observation
// where no row claims a noise of its own.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "fastcal/identification/problem.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {

/// Squared residuals of one observation in one row, and the variances that their row claims.
struct ObservedRow {
  std::span<const double> squares;  ///< NaN where not measured; what they are of must outlive it
  std::span<const double> claimed;
  int components = 0;  ///< that were measured

  double whitened(double tau) const {
    double sum = 0;
    for (std::size_t c = 0; c < squares.size(); ++c) {
      if (squares[c] == squares[c]) sum += squares[c] / (claimed[c] + tau * tau);
    }
    return sum;
  }
};

/// What a fit leaves of the rows that hold a number of an observation.
class ObservedRows {
 public:
  ObservedRows() = default;
  /// Of rows that all have so many numbers and claim no noise: their squared lengths, which must outlive it.
  ObservedRows(int components, std::span<const double> squares) : all_(squares), of_all_(components) {}

  /// Room for so many rows that claim no noise.
  void reserve(int components, std::size_t rows) { own_[components].reserve(rows); }
  /// A row that claims no noise.
  void add(int components, double square) { own_[components].push_back(square); }
  void add(const ObservedRow& row) { claiming_.push_back(row); }

  /// Squared lengths of rows that claim no noise and have so many numbers.
  std::span<const double> unclaimed(int components) const {
    if (!all_.empty() && components == of_all_) return all_;
    const auto found = own_.find(components);
    return found == own_.end() ? std::span<const double>() : std::span<const double>(found->second);
  }
  /// How many numbers such rows have, ascending.
  std::vector<int> counts() const;
  const std::vector<ObservedRow>& claiming() const { return claiming_; }
  std::size_t count() const;

 private:
  std::span<const double> all_;
  int of_all_ = 0;
  std::map<int, std::vector<double>> own_;
  std::vector<ObservedRow> claiming_;
};

class RowErrors {
 public:
  /// At theta.
  RowErrors(const Problem& problem, const Eigen::VectorXd& theta);
  /// Of residuals (N, numbers), NaN where not measured.
  RowErrors(const Problem& problem, const RowMatrixXd& residuals);

  Eigen::Index row_count() const { return rows_; }

  /// Sums over all rows, the same on any number of threads: add(sums, i) for every row of a block on sums of its own,
  /// which then are added up in the order of the blocks by join(sums).
  template <typename Sums, typename Add, typename Join>
  void sum_rows(const Sums& zero, const Add& add, const Join& join) const {
    std::vector<Sums> blocks(static_cast<std::size_t>(block_count()), zero);
    each_block([&](Eigen::Index block, Eigen::Index begin, Eigen::Index end) {
      Sums sums = zero;  // apart from those that other threads write
      for (Eigen::Index i = begin; i < end; ++i) add(sums, i);
      blocks[static_cast<std::size_t>(block)] = sums;
    });
    for (const Sums& sums : blocks) join(sums);
  }

  /// Calls body(i) for every row on all threads; rows that share a word of a vector of truth values on the same one.
  template <typename Body>
  void each_row(const Body& body) const {
    each_block([&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
      for (Eigen::Index i = begin; i < end; ++i) body(i);
    });
  }
  int observation_count() const { return static_cast<int>(of_.size()); }

  /// Of one observation, as long as this is there; of the rows `kept` alone (empty: of all).
  ObservedRows observed(int observation, const std::vector<bool>& kept = {}) const;

  /// Numbers that a row may hold.
  int most_numbers() const;

  /// Numbers of an observation that were measured.
  Eigen::Index number_count(int observation) const;

  /// Numbers that were measured in row i.
  int components(Eigen::Index i) const {
    int sum = 0;
    for (const Observed& of : of_) sum += of.components[static_cast<std::size_t>(i)];
    return sum;
  }

  /// Row i at a common noise, not weighted.
  RowWeight whitened(Eigen::Index i, const CommonNoise& tau) const;

  /// Sum of the variances that the rows claim for the numbers of an observation.
  double claimed_variance(int observation) const;

  /// 1/2 sum rho.
  double cost(const Weighting& weighting) const;

  /// Weights of all rows.
  std::vector<RowWeight> weights(const Weighting& weighting) const;

 private:
  struct Observed {
    int most = 0;                           // numbers of a row
    bool is_whole = true;                   // were all of them measured in all rows?
    std::vector<std::uint16_t> components;  // (N) how many of them were measured
    std::vector<double> squares;            // (N) sum of their squares; where rows claim a noise (N x most), NaN: none
    std::vector<double> claimed;            // (N x most) variances; empty: none is claimed
  };

  static constexpr Eigen::Index kBlockRows = 4096;
  static_assert(kBlockRows % 64 == 0, "no two blocks may share a word of a vector of truth values");

  Eigen::Index block_count() const { return (rows_ + kBlockRows - 1) / kBlockRows; }
  template <typename Body>
  void each_block(const Body& body) const {
    parallel_units(
        block_count(), workers_, [] { return 0; },
        [&](int, Eigen::Index block) { body(block, block * kBlockRows, std::min(rows_, (block + 1) * kBlockRows)); });
  }

  RowErrors(const Problem& problem, Eigen::Index rows);
  void look_for_gaps();
  void set(const Measurements& measured, Eigen::Index i, Eigen::Index in_part, const double* residuals);

  Eigen::Index rows_;
  int workers_;
  std::vector<Observed> of_;
};

}  // namespace fastcal
