// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/measurement/observation.hpp"

namespace fastcal {

const std::vector<Parameter>& Observation::parameters() const {
  static const std::vector<Parameter> none;
  return none;
}

std::string Observation::start(const std::vector<Sights>& /*sights*/, Eigen::Ref<Eigen::VectorXd> /*unknowns*/) const {
  return "";
}

}  // namespace fastcal
