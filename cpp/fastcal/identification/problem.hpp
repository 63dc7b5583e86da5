// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The least-squares problem of a model and its measurements: whitened, weighted, reduced to normal equations in one
// pass over the rows. theta = [model parameters; unknowns of the observations]. Residual of row i, number c: r_ic /
// s_ic, s_ic^2 = sigma_ic^2 + tau_o^2, o the observation that c is of.
#pragma once

#include <algorithm>
#include <vector>

#include "fastcal/identification/loss.hpp"
#include "fastcal/identification/row_source.hpp"
#include "fastcal/model/error_model.hpp"
#include "fastcal/model/twist_memory.hpp"

namespace fastcal {

/// What the loads' change adds to the residuals at fixed loads, r += sum_k change_k y_k, y = directions^T (theta -
/// origin).
struct LoadResponse {
  Eigen::VectorXd origin;              ///< theta of the present loads
  Eigen::MatrixXd directions;          ///< (theta's size, k)
  Eigen::VectorXd found_at;            ///< theta
  Eigen::MatrixXd steps;               ///< (theta's size, k) from there to both sides, over which the change was found
  std::vector<RowMatrixXd> change;     ///< k of (N, numbers); of the rows in memory
  std::vector<RowMatrixXd> of_source;  ///< the same of all rows of a source; none where they are too many to keep
};

/// Model, conditions and measurements, which must outlive it.
struct Problem {
  const ErrorModel& model;
  const Samples& samples;        ///< all rows, or some of those of `source`
  const Measurements& measured;  ///< the same rows
  int threads = 1;
  const LoadResponse* response = nullptr;       ///< none: loads do not move
  TwistMemory* memory = nullptr;                ///< of these samples, as they are
  const RowSource* source = nullptr;            ///< where all rows are; none: they are in memory
  const Eigen::VectorXd* settled_at = nullptr;  ///< theta at which loads of the rows of `source` settle; none: no loads

  int parameter_count() const { return model.parameter_count() + measured.unknown_count(); }
  /// Threads that a pass over the rows is worth: starting one takes as long as several chunks.
  int workers() const;
  Eigen::Index row_count() const { return source == nullptr ? samples.count() : source->count(); }
  /// Throws InvalidInput where the tables do not fit.
  void check() const;
};

/// Some rows of a problem whose rows are elsewhere, with the loads that the whole has.
class Part {
 public:
  Part(const Problem& whole, Eigen::Index begin, Eigen::Index end);
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  Problem problem() const;

 private:
  const Problem& whole_;
  SomeRows rows_;
  Samples settled_;
  LoadResponse response_;
};

/// Calls body(part, first) for problems of all rows in their order, parts of them as far as they are not in memory.
template <typename Body>
void each_part(const Problem& whole, const Body& body) {
  constexpr Eigen::Index kPartRows = 30'720;  // whole chunks and units: sums are those of rows in memory
  if (whole.source == nullptr) {
    body(whole, Eigen::Index{0});
    return;
  }
  for (Eigen::Index first = 0; first < whole.row_count(); first += kPartRows) {
    const Part part(whole, first, std::min(whole.row_count(), first + kPartRows));
    body(part.problem(), first);
  }
}

/// Noise that all rows share, beside what each row claims: a standard deviation for each observation, in its unit.
using CommonNoise = std::vector<double>;

/// How residuals are weighted.
struct Weighting {
  CommonNoise tau;
  LossKind loss = LossKind::kNone;
  bool is_curved = true;  ///< with what the loss takes from the curvature; without, the steps are Gauss and Newton's
};

/// A row's part of the weighted sum.
struct RowWeight {
  double squared = 0;  ///< u^2: whitened squared length of the residual
  double weight = 1;   ///< rho'
  int components = 0;  ///< d, how many numbers the row has; 0: nothing was measured
};

/// Sums over all rows: A = J^T W J, g = J^T W r, cost = 1/2 sum rho; columns of `free`, scaled by `scale`.
struct NormalEquations {
  Eigen::MatrixXd A;
  /// By which the Hessian of a robust cost is flatter than A: sum of -u w'(u) (J_i^T u_i)(J_i^T u_i)^T / u^2 over the
  /// rows i, whitened. Empty without a loss.
  Eigen::MatrixXd flattening;
  Eigen::VectorXd g;
  double cost = 0;
};

/// One pass over the rows. With `with_jacobian` false, only the cost is formed. The sums do not depend on the number of
/// threads.
NormalEquations normal_equations(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                 const Eigen::VectorXd& scale, const Weighting& weighting, bool with_jacobian);

/// Sums over all rows of the whitened, scaled J without robust weights, in one pass.
struct PlainSums {
  Eigen::MatrixXd A;  ///< (last, last) J^T J of so many columns, the last ones
  Eigen::VectorXd g;  ///< (last) J^T W r of these: the slope of the weighted cost
  double along = 0;   ///< the larger |J d|^2 of two directions d, (columns, 2); of none, 0
};
PlainSums plain_sums(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& columns,
                     const Eigen::VectorXd& scale, const Weighting& weighting, Eigen::Index last,
                     const Eigen::MatrixXd& directions);

/// Residuals (N, numbers) as they are, NaN where not measured, of rows in memory.
RowMatrixXd residuals(const Problem& problem, const Eigen::VectorXd& theta);

/// The upper triangular factor (p x p) of the whitened, scaled J without robust weights: QR by blocks of rows, which
/// sees singular values down to 1e-15 of the largest where A sees 1e-8. With `g`, in the same pass, also the slope
/// J^T W r of the weighted cost.
Eigen::MatrixXd triangular_factor(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                  const Eigen::VectorXd& scale, const Weighting& weighting,
                                  Eigen::VectorXd* g = nullptr);

}  // namespace fastcal
