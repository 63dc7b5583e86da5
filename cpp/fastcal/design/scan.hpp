// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A design is a sum of candidates, M = M_0 + sum J_c^T J_c. A scan knows, for every candidate at once, what adding it
// would gain, and keeps that up to date by rank-k changes when one is added or taken away (V. Fedorov, "Theory of
// Optimal Experiments", 1972, 3.2; with S_c = J_c M^-1 J_c^T and I +- S_c = L L^T):
//   M'^-1 = M^-1 -+ U U^T,  U = M^-1 J_c^T L^-T,      S'_d = S_d -+ (J_d U) (J_d U)^T.
#pragma once

#include <memory>

#include "fastcal/design/candidates.hpp"

namespace fastcal::design {

class Scan {
 public:
  /// `candidates` must outlive it.
  Scan(const Candidates& candidates, int threads);
  virtual ~Scan() = default;
  Scan(const Scan&) = delete;
  Scan& operator=(const Scan&) = delete;

  const Candidates& candidates() const { return candidates_; }
  /// M^-1 of the present design.
  const Eigen::MatrixXd& covariance() const { return covariance_; }

  /// Begins (again) from the information matrix M, positive definite, without the rounding that changes leave behind.
  void restart(const Eigen::MatrixXd& M);
  void add(Eigen::Index candidate) { change(candidate, 1); }
  /// `candidate` must be in the design, and M without it positive definite.
  void remove(Eigen::Index candidate) { change(candidate, -1); }

  /// By how much value() would rise if each candidate were added (N).
  Eigen::VectorXd gains() const;
  /// The same if one that is in the design were taken away: a loss, below 0.
  double gain_of_removing(Eigen::Index candidate) const { return gain(candidate, s_of(candidate), -1); }
  /// First-order gain of each candidate (N).
  virtual Eigen::VectorXd sensitivities() const = 0;
  /// No design is worth more whose sensitivities sum up to `excess` more than those of this one: value() is concave.
  virtual double bound(double excess) const { return value() + excess; }
  /// What the design is worth: log det M, or minus the variance.
  virtual double value() const = 0;
  /// The same goal over other candidates.
  virtual std::unique_ptr<Scan> over(const Candidates& candidates) const = 0;

 protected:
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostRows, kMostRows>;

  /// What a goal knows of the candidates beside S; called by restart(), M^-1 and S are those of M.
  virtual void restart_goal(const Eigen::MatrixXd& /*M*/) {}
  /// Before a change: its U and L^-1, M^-1 still as it was. Returns columns V by which each J_d is to be multiplied
  /// besides U.
  virtual Eigen::MatrixXd prepare(Eigen::Index /*candidate*/, const Eigen::MatrixXd& U, const Small& /*L_inverse*/,
                                  double /*sign*/) {
    Eigen::MatrixXd none(U.rows(), 0);
    return none;
  }
  /// The change of one block: X[row * columns + column] = J_d [U V], lane by lane.
  virtual void change_block(Eigen::Index /*block*/, const Lane* /*X*/, int /*columns*/, double /*sign*/) {}
  /// Gain of adding (sign 1) or taking away (-1) one candidate whose S is given.
  virtual double gain(Eigen::Index candidate, const Small& S, double sign) const = 0;

  Small s_of(Eigen::Index candidate) const;
  /// One number of a candidate in a store of (blocks, size, lanes).
  static double lane(const std::vector<double>& store, Eigen::Index size, Eigen::Index candidate, Eigen::Index i) {
    return store[static_cast<std::size_t>(((candidate / kLanes) * size + i) * kLanes + candidate % kLanes)];
  }
  std::vector<double> store(Eigen::Index size) const {
    std::vector<double> out(static_cast<std::size_t>(candidates_.blocks() * size * kLanes), 0.0);
    return out;
  }

  const Candidates& candidates_;
  int threads_;
  int k_;
  Eigen::MatrixXd covariance_;
  double log_determinant_ = 0;  // of M

 private:
  void change(Eigen::Index candidate, double sign);

  std::vector<double> S_;  // (blocks, k, k, lanes)
};

/// out (k, k) -= factor X_first X_second^T, slices of `width` columns of X (k, columns).
inline void subtract_product(Lane* out, const Lane* X, int k, int columns, int first, int second, int width,
                             double factor) {
  for (int a = 0; a < k; ++a) {
    for (int b = 0; b < k; ++b) {
      Lane sum{};
      for (int m = 0; m < width; ++m) sum += X[a * columns + first + m] * X[b * columns + second + m];
      out[a * k + b] -= factor * sum;
    }
  }
}

/// Value: log det M (D-optimality: 2 p times the logarithm of O1 sqrt(n)).
class DeterminantScan : public Scan {
 public:
  using Scan::Scan;
  double value() const override { return log_determinant_; }
  Eigen::VectorXd sensitivities() const override;
  std::unique_ptr<Scan> over(const Candidates& candidates) const override;

 protected:
  double gain(Eigen::Index candidate, const Small& S, double sign) const override;
};

/// Value: -tr(M^-1 B) (V-optimality); with B = mean of J_t^T J_t over targets t that is their mean predicted variance.
/// With P = M^-1 B M^-1, G_c = J_c P J_c^T the gain of c is tr((I + S_c)^-1 G_c), and a change
/// takes P' = P -+ (U V^T + V U^T),  V = M^-1 B U -+ 1/2 U (U^T B U).
class VarianceScan : public Scan {
 public:
  VarianceScan(const Candidates& candidates, const Eigen::MatrixXd& B, int threads);
  double value() const override { return -covariance_.cwiseProduct(B_).sum(); }
  /// 1 / tr(M^-1 B) too is concave in M (F. Pukelsheim, "Optimal design of experiments", 1993, 5.14), a tighter bound.
  double bound(double excess) const override { return value() / (1 - excess / value()); }
  Eigen::VectorXd sensitivities() const override;
  std::unique_ptr<Scan> over(const Candidates& candidates) const override;

 protected:
  void restart_goal(const Eigen::MatrixXd& M) override;
  Eigen::MatrixXd prepare(Eigen::Index candidate, const Eigen::MatrixXd& U, const Small& L_inverse,
                          double sign) override;
  void change_block(Eigen::Index block, const Lane* X, int columns, double sign) override;
  double gain(Eigen::Index candidate, const Small& S, double sign) const override;

 private:
  Eigen::MatrixXd B_;
  Eigen::MatrixXd root_;   // B = root root^T
  std::vector<double> G_;  // (blocks, k, k, lanes)
};

}  // namespace fastcal::design
