// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Which of many blocks of columns is missing from a least-squares model? Score (Lagrange multiplier) tests of all of
// them from one fit. With the whitened Jacobian A of the fitted parameters, the whitened columns C_i of a block and the
// whitened residual r (J dtheta ~ r), P = 1 - A A^+ and an orthonormal basis B_i of P C_i:
//   T_i = |B_i^T r|^2 ~ chi2(rank B_i, lambda),   b_i = (P C_i)^+ r,   cov b_i = ((P C_i)^T P C_i)^+ .
// C. R. Rao, "Large sample tests of statistical hypotheses", 1948; as T_q of geodesy: P. Teunissen, "Distributional
// theory for the DIA method", Journal of Geodesy 92 (2018). Knows no robot: matrices in, numbers out.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// One number a block.
struct BlockScores {
  Eigen::VectorXi rank;       ///< directions that the fitted parameters do not absorb
  Eigen::VectorXd statistic;  ///< T_i
};

/// C and r without what the fitted parameters A can do, as a caller with another way to project them has them.
struct ProjectedBlocks {
  Eigen::MatrixXd R;       ///< (k, c) of C, its columns scaled to length 1; any k rows with the right inner products
  Eigen::VectorXd r;       ///< (k)
  Eigen::VectorXd length;  ///< (c) of the columns of C before that
  int null_rank = 0;       ///< rank of A
};

class ScoreTests {
 public:
  /// `A` (m, p), `C` (m, c), `r` (m); `sizes`: columns of each block, in order. A prior is a row with its own equation.
  /// A direction of a block, its columns scaled to length 1, of which A leaves less than `least` is "absorbed".
  /// Throws InvalidInput where sizes differ or a number is not finite.
  ScoreTests(const Eigen::Ref<const Eigen::MatrixXd>& A, const Eigen::Ref<const Eigen::MatrixXd>& C,
             const Eigen::Ref<const Eigen::VectorXd>& r, const std::vector<int>& sizes, double least = kLeast);
  /// The same from what A leaves of C and r.
  explicit ScoreTests(ProjectedBlocks projected, const std::vector<int>& sizes, double least = kLeast);

  int block_count() const { return static_cast<int>(scores_.rank.size()); }
  /// Rank of A.
  int null_rank() const { return null_rank_; }
  /// |P r|^2 ~ chi2(m - rank A) where nothing is missing.
  double remaining() const { return r_.squaredNorm(); }
  const BlockScores& scores() const { return scores_; }
  /// (blocks) root of the mean share of a column's square that A leaves.
  const Eigen::VectorXd& surviving() const { return surviving_; }
  /// (c) b_i of each block when it alone is added, and its standard deviations for noise 1; 0 and infinity along what
  /// is absorbed.
  const Eigen::VectorXd& estimate() const { return estimate_; }
  const Eigen::VectorXd& deviation() const { return deviation_; }
  /// (c) length of each column, as given, that A does not absorb: its parameter b alone has lambda = (length b)^2.
  const Eigen::VectorXd& length() const { return length_; }

  /// The tests of all blocks once the blocks `added` are in the model too; those of `added` have rank and statistic 0.
  BlockScores given(const std::vector<int>& added) const;
  /// |P r|^2 less what all blocks `added` explain together, and the rank of these.
  double remaining_with(const std::vector<int>& added, int& rank) const;
  /// (of, with) largest canonical correlation of the pairs, after what A absorbs; 0 where a block has rank 0.
  Eigen::MatrixXd correlation(const std::vector<int>& of, const std::vector<int>& with) const;
  /// (of, with) share of a block's explained square that another block explains as well: |B_k B_k^T s_i|^2 / |s_i|^2,
  /// s_i = B_i B_i^T r its fitted signature.
  Eigen::MatrixXd shared(const std::vector<int>& of, const std::vector<int>& with) const;
  /// (columns) root of the noncentrality at which a column alone, in all that A leaves of it, lets some block's
  /// statistic pass its limit with probability `power`: over `draws` of noise, the same for all columns. Infinite where
  /// A absorbs the column. `limits` (blocks): of the statistics; infinite: a block that is not tested.
  Eigen::VectorXd detectable(const std::vector<int>& columns, const Eigen::VectorXd& limits, double power, int draws,
                             std::uint64_t seed, int threads = 1) const;

 private:
  static constexpr double kLeast = 3e-3;

  /// Columns of B_ of a block.
  auto basis(int block) const { return B_.middleCols(first_[block], scores_.rank[block]); }
  /// Q^T B and Q^T r, Q an orthonormal basis of the blocks `added`.
  struct Joined {
    Eigen::MatrixXd of_all;
    Eigen::VectorXd of_r;
  };
  Joined joined(const std::vector<int>& added) const;
  /// (k, used) X^T B of X (m - rank A, k).
  Eigen::MatrixXd along_all(const Eigen::MatrixXd& X, int threads) const;
  void check(const std::vector<int>& blocks) const;

  Eigen::MatrixXd B_;      // (m - rank A, sum of ranks) orthonormal within each block
  Eigen::VectorXd r_;      // (m - rank A)
  Eigen::VectorXd along_;  // (sum of ranks) B^T r
  Eigen::VectorXi first_;
  BlockScores scores_;
  Eigen::VectorXd surviving_, estimate_, deviation_, length_;
  std::vector<Eigen::VectorXd> within_;  // (c) unit vectors of the columns in the bases of their blocks
  std::vector<int> block_of_;            // (c)
  int null_rank_ = 0;

  /// B_i^T B of the blocks that were asked for: sets that grow ask for the same ones again.
  struct Products {
    std::mutex mutex;
    std::map<int, Eigen::MatrixXd> of_block;
  };
  std::shared_ptr<Products> products_ = std::make_shared<Products>();
};

}  // namespace fastcal
