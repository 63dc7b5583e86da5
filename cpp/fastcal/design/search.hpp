// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Which candidates to measure: grown one at a time, then exchanged. An exchange takes a member away and adds the best
// candidate in its place (R. Cook, C. Nachtsheim, "A comparison of algorithms for constructing exact D-optimal
// designs", Technometrics 22, 1980: modified Fedorov), and is done among the candidates that promise most at the moment
// (A. Atkinson, A. Donev, "The construction of exact D-optimum experimental designs", Biometrika 76, 1989); these are
// chosen again from all until nothing improves. All is deterministic, ties go to the candidate that comes first.
#pragma once

#include <cstdint>

#include "fastcal/design/scan.hpp"

namespace fastcal::design {

struct SearchOptions {
  int count = 0;                                            ///< members at most, each once
  bool exchange = true;                                     ///< false: growth alone
  double enough = std::numeric_limits<double>::infinity();  ///< value at which no further member is needed
  double tolerance = 1e-5;        ///< a round that raises value() by less than this share, or this, is the last
  Eigen::Index shortlist = 2000;  ///< candidates that take part in the exchanges of a round
  int most_rounds = 20;
};

struct Choice {
  std::vector<Eigen::Index> members;
  double value = 0;
  double bound = 0;  ///< no choice of as many candidates, each once, has a larger value()
};

/// `count` members, each once, one after the other the one that gains most; `start` is known before.
std::vector<Eigen::Index> grow(Scan& scan, const Eigen::MatrixXd& start, Eigen::Index count);

/// Exchanges `members` as long as that pays.
Choice exchange(Scan& scan, const Eigen::MatrixXd& start, std::vector<Eigen::Index> members,
                const SearchOptions& options = {});

/// count candidates of [0, n) drawn without replacement; the same seed gives the same on every machine.
std::vector<Eigen::Index> draw(Eigen::Index n, Eigen::Index count, std::uint64_t seed);

/// The `count` candidates with the largest scores and all of `always`, ascending.
std::vector<Eigen::Index> best_of(const Eigen::VectorXd& scores, Eigen::Index count,
                                  const std::vector<Eigen::Index>& always);

}  // namespace fastcal::design
