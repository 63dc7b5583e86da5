// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Which directions of the parameter space the data determine, which parameters the gauge holds, and why, in words.
// All of it works on R, the triangular factor of the whitened Jacobian with columns scaled by plausible sizes: a
// singular value s means that the data determine this direction with a standard deviation of 1 / s plausible sizes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

struct GaugeOptions {
  bool off = false;                  ///< everything is free: priors fix what the data do not
  double relative_tolerance = 1e-9;  ///< below this share of the largest singular value a direction does nothing at all
  double practical_limit = 10;       ///< a standard deviation of more plausible sizes than this: not identifiable
};

/// What is free, what is held, and why.
struct Gauge {
  std::vector<int> free;       ///< positions (0 ... p - 1) that the data fix, ascending
  std::vector<int> held;       ///< positions held at nominal, ascending
  int rank = 0;                ///< directions that do anything at all (structural rank)
  Eigen::MatrixXd directions;  ///< (p, held): moving held parameter k by 1 (scaled) and the free ones by this changes
                               ///< (nearly) nothing
};

/// Does an upper triangular factor R say beyond doubt that the data fix its first `rank` columns, and show nothing of
/// the others? With R = [R1 R2; 0 R3], sigma_rank >= 1 / |R1^-1| and sigma_rank+1 <= |R3| (Frobenius norms).
bool parts_clearly(const Eigen::MatrixXd& R, Eigen::Index rank, const GaugeOptions& options);

/// Chooses the gauge: singular directions by SVD of R (by QR, and the weak ones by the inverse of its triangle, where
/// that tells the same), then the parameters to hold by QR with column pivoting of the null basis, weighted by `hold`
/// (large: hold this rather than others), which keeps what is left as well conditioned as the data allow (G. Golub,
/// C. Van Loan, "Matrix Computations", 4th ed., 5.5.7: subset selection). Whatever `hold` says, one that would run
/// away by the smallest error of a held one is held in its stead.
Gauge choose_gauge(const Eigen::MatrixXd& R, const Eigen::VectorXd& hold, const GaugeOptions& options = {});

/// Priority of holding a parameter: base, tool and set-ups last (no arm is measured without them), beta first (it
/// serves only where the axes are so nearly parallel that d would run away), an effect rather than the geometry.
double fixing_priority(const Parameter& parameter);

/// "joint1 d and base z move together", "joint6 theta is not observable": one sentence a column of
/// gauge.directions.
std::vector<std::string> describe_directions(const Gauge& gauge, const std::vector<const Parameter*>& parameters);
std::vector<std::string> describe_directions(const Gauge& gauge, const std::vector<Parameter>& parameters);

}  // namespace fastcal
