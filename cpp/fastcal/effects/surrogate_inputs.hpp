// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What a surrogate's function may depend on, by name: "q3", "load3", "approach3" of a joint, "extra:0" a column of
// State::extra, "payload", "time", "temperature", "gravity_x" (its direction in the tool's axes), "weight_x" (the same
// times the payload), "down3_x" (in the axes of link 3), "sight_x" (direction from the instrument, in the tool's axes),
// "forward_x" and "forward_y" (direction of the tool from the instrument, seen from above), "height" (sine of its
// elevation), "range", "x", "y", "z" (of the tool, measuring frame). SI.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "fastcal/effects/effect.hpp"

namespace fastcal {

struct SurrogateInput {
  std::function<double(const State&)> value;
  unsigned needs;      ///< bits of Need
  std::string column;  ///< of the data that it cannot do without; empty: none

  SurrogateInput(std::function<double(const State&)> of = {}, unsigned bits = kNothing, std::string name = {})
      : value(std::move(of)), needs(bits), column(std::move(name)) {}
};

/// Throws InvalidInput where a name is not known.
SurrogateInput surrogate_input(const std::string& name, const RobotModel& robot);

/// The inputs of names parted by spaces.
std::vector<SurrogateInput> surrogate_inputs(const std::string& names, const RobotModel& robot);

}  // namespace fastcal
