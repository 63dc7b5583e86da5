// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/decompositions.hpp"

template class Eigen::JacobiSVD<Eigen::MatrixXd>;
