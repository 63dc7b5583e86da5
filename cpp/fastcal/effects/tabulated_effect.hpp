// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// An effect that a user registered in Python: it gives the twists of its basis for all rows at once, and here they are
// only looked up.
//   xi_f = sum_k theta_k table[f, k],  6 numbers each, in this order in State::table from `first` on.
#pragma once

#include <string>
#include <vector>

#include "fastcal/effects/effect.hpp"

namespace fastcal {

class TabulatedEffect : public LinearEffect {
 public:
  /// `frames`: the chain's frames that it moves, by number.
  TabulatedEffect(std::vector<Parameter> parameters, std::vector<int> frames, int first, bool follows_loads = false);

  const std::vector<Parameter>& parameters() const override { return parameters_; }
  bool follows_loads() const override { return follows_loads_; }
  void basis(const State& state, TwistColumns& columns) const override;

  /// How many columns of the table belong to it.
  int width() const { return 6 * static_cast<int>(frames_.size() * parameters_.size()); }

 private:
  std::vector<Parameter> parameters_;
  std::vector<int> frames_;
  int first_;
  bool follows_loads_;
};

}  // namespace fastcal
