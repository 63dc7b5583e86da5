// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The identification problem near a parameter vector, as a linear one: what is measured changes by J dtheta.
// All rows at once, for what looks at many subsets of columns or rows; identify() never forms it.
#pragma once

#include "fastcal/identification/problem.hpp"

namespace fastcal {

/// One row a measured number, divided by its standard deviation; SI parameters.
struct Linearization {
  RowMatrixXd J;           ///< (n, parameters and unknowns of observations) d r / d theta
  Eigen::VectorXd r;       ///< (n) predicted less measured
  Eigen::VectorXi row;     ///< (n) the row of the data that the number belongs to
  Eigen::VectorXi number;  ///< (n) which number of its row
};

/// Loads are brought to equilibrium at theta first. Standard deviation of a number: its own claim and `tau`, root of
/// squares. Without `columns` J has none.
Linearization linearize(const Problem& problem, const Eigen::VectorXd& theta, const CommonNoise& tau,
                        bool columns = true);

}  // namespace fastcal
