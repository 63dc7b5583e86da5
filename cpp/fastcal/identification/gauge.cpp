// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/gauge.hpp"

#include <cmath>
#include <utility>

#include "fastcal/identification/load_response.hpp"

namespace fastcal {
namespace {

/// The present parameters on an arm that its beams do not bend. What moves the frames along the arm and nothing else
/// looks as if the bend could determine it; how the bend itself would change with it, no derivative holds.
Eigen::VectorXd unbent(const FitState& fit) {
  Eigen::VectorXd theta = fit.theta;
  Eigen::Index first = fit.problem.model.robot().nominal().size();
  for (const auto& effect : fit.problem.model.effects()) {
    const auto count = static_cast<Eigen::Index>(effect->parameters().size());
    if (effect->needs() & kBending) theta.segment(first, count).setZero();
    first += count;
  }
  return theta;
}

/// Moves theta along the null directions so that the held parameters come back to where they started; false where they
/// were there.
bool return_held(FitState& fit) {
  Eigen::VectorXd x = (at(fit.theta, fit.asked) - at(fit.start, fit.asked)).cwiseQuotient(fit.scale);
  const bool moves = (x(fit.gauge.held).array() != 0).any();
  for (std::size_t k = 0; k < fit.gauge.held.size(); ++k)
    x -= x[fit.gauge.held[k]] * fit.gauge.directions.col(static_cast<Eigen::Index>(k));
  for (std::size_t k = 0; k < fit.asked.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    fit.theta[fit.asked[k]] = fit.start[fit.asked[k]] + fit.scale[i] * x[i];
  }
  for (const int k : fit.gauge.held) {
    const int index = fit.asked[static_cast<std::size_t>(k)];
    fit.theta[index] = fit.start[index];
  }
  return moves;
}

}  // namespace

Eigen::MatrixXd gauge_factor(FitState& fit) { return fit.gauge_factor(unbent(fit)); }

bool confirms_gauge(FitState& fit) { return !fit.is_chosen_by_some() && fit.confirms_gauge(unbent(fit)); }

void follow_loads(FitState& fit) {
  if ((fit.problem.model.needs() & kLoads) == 0) return;
  fit.problem.response = nullptr;
  fit.forget();
  fit.response = load_response(fit.problem, fit.theta, fit.asked, fit.scale, gauge_factor(fit));
  if (fit.response) {
    fit.problem.response = &*fit.response;
    keep_changes(fit.problem, *fit.response);
  }
  fit.forget();
}

void choose_free(FitState& fit) {
  // Null directions are those at constant loads, and loads change along them: an axis that leans after the coarse fit
  // shows its compliance, but not where the gauge has put it upright. Free there, the compliance would run away by the
  // rounding of its loads.
  follow_loads(fit);
  Gauge here = choose_gauge(gauge_factor(fit), fit.hold, fit.options.gauge);
  do {
    fit.gauge = std::move(here);
    if (!return_held(fit) || (fit.problem.model.needs() & kLoads) == 0) break;
    fit.bring_to_equilibrium();
    here = choose_gauge(gauge_factor(fit), fit.hold, fit.options.gauge);
  } while (here.free.size() < fit.gauge.free.size());
  fit.free.clear();
  for (const int k : fit.gauge.free) fit.free.push_back(fit.asked[static_cast<std::size_t>(k)]);
  fit.free_scale = at(fit.scale, fit.gauge.free);
}

void report_gauge(FitState& fit, Identification& out) {
  for (const int k : fit.gauge.held) out.held.push_back(fit.asked[static_cast<std::size_t>(k)]);
  out.asked = fit.asked;
  out.held_directions = fit.scale.asDiagonal() * fit.gauge.directions;
  out.rank = fit.has_priors() ? choose_gauge(fit.asked_factor(unbent(fit)), fit.hold).rank : fit.gauge.rank;
  std::vector<const Parameter*> asked_parameters;
  asked_parameters.reserve(fit.asked.size());
  for (const int index : fit.asked) asked_parameters.push_back(&fit.parameters[static_cast<std::size_t>(index)]);
  out.unidentifiable = describe_directions(fit.gauge, asked_parameters);
  for (std::size_t column = 0; column < out.unidentifiable.size(); ++column) {
    std::vector<int> parts{fit.asked[static_cast<std::size_t>(fit.gauge.held[column])]};
    const Eigen::VectorXd direction = fit.gauge.directions.col(static_cast<Eigen::Index>(column));
    for (std::size_t k = 0; k < fit.asked.size(); ++k) {
      const bool is_held = static_cast<int>(k) == fit.gauge.held[column];
      if (!is_held && std::abs(direction[static_cast<Eigen::Index>(k)]) > 0.02) parts.push_back(fit.asked[k]);
    }
    out.unidentifiable_parts.push_back(std::move(parts));
  }
}

}  // namespace fastcal
