// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#pragma once

// The singular values of Eigen, compiled once (decompositions.cpp): in each file that uses them they would take longer
// to compile than all the rest of it.

#include <Eigen/SVD>

extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
