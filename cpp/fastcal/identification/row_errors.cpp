// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/row_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/identification/whitened_rows.hpp"

namespace fastcal {

std::size_t ObservedRows::count() const {
  std::size_t out = claiming_.size();
  for (const int d : counts()) out += unclaimed(d).size();
  return out;
}

std::vector<int> ObservedRows::counts() const {
  std::vector<int> out;
  if (!all_.empty()) out.push_back(of_all_);
  for (const auto& [components, squares] : own_) {
    if (!squares.empty()) out.push_back(components);
  }
  return out;
}

RowErrors::RowErrors(const Problem& problem, Eigen::Index rows) : rows_(rows), workers_(problem.workers()) {
  const auto count = static_cast<std::size_t>(rows);
  for (const PlacedObservation& observation : problem.measured.observations()) {
    Observed& of = of_.emplace_back();
    of.most = observation.component_count;
    of.components.resize(count);
    const bool claims = observation->claims_sigma();
    of.squares.resize(claims ? count * static_cast<std::size_t>(of.most) : count);
    if (claims) of.claimed.resize(of.squares.size());
  }
}

RowErrors::RowErrors(const Problem& problem, const Eigen::VectorXd& theta) : RowErrors(problem, problem.row_count()) {
  const std::vector<int> none;
  const Eigen::VectorXd scale;
  const CommonNoise one(problem.measured.observations().size(), 1.0);
  each_part(problem, [&](const Problem& part, Eigen::Index first) {
    const auto worker = [&] { return WhitenedRows(part, theta, none, scale, one); };
    parallel_chunks(part.samples.count(), part.workers(), worker,
                    [&](WhitenedRows& rows, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
                      std::vector<double> row(static_cast<std::size_t>(rows.number_count()));
                      rows.evaluate(begin, end);
                      for (Eigen::Index i = begin; i < end; ++i) {
                        std::fill(row.begin(), row.end(), std::numeric_limits<double>::quiet_NaN());
                        rows.raw(static_cast<int>(i - begin), row.data());
                        set(part.measured, first + i, i, row.data());
                      }
                    });
  });
  look_for_gaps();
}

RowErrors::RowErrors(const Problem& problem, const RowMatrixXd& residuals) : RowErrors(problem, residuals.rows()) {
  each_row([&](Eigen::Index i) { set(problem.measured, i, i, residuals.row(i).data()); });
  look_for_gaps();
}

void RowErrors::look_for_gaps() {
  for (Observed& of : of_)
    of.is_whole = std::all_of(of.components.begin(), of.components.end(), [&](int count) { return count == of.most; });
}

void RowErrors::set(const Measurements& measured, Eigen::Index i, Eigen::Index in_part, const double* residuals) {
  for (std::size_t k = 0; k < of_.size(); ++k) {
    Observed& of = of_[k];
    const PlacedObservation& observation = measured.observations()[k];
    const double* r = residuals + observation.first_number;
    std::uint16_t known = 0;
    double sum = 0;
    for (int c = 0; c < of.most; ++c) {
      const bool is_known = !std::isnan(r[c]);
      known += is_known;
      if (is_known) sum += r[c] * r[c];
      if (of.claimed.empty()) continue;
      const auto at = static_cast<std::size_t>(i * of.most + c);
      const double own = is_known ? observation->sigma(in_part, c) : 0;
      of.squares[at] = r[c] * r[c];
      of.claimed[at] = own * own;
    }
    of.components[static_cast<std::size_t>(i)] = known;
    if (of.claimed.empty()) of.squares[static_cast<std::size_t>(i)] = sum;
  }
}

ObservedRows RowErrors::observed(int observation, const std::vector<bool>& kept) const {
  const Observed& of = of_[static_cast<std::size_t>(observation)];
  const auto wanted =
      kept.empty() ? of.components.size() : static_cast<std::size_t>(std::count(kept.begin(), kept.end(), true));
  if (of.claimed.empty() && of.is_whole && wanted == of.components.size()) return {of.most, of.squares};
  ObservedRows out;
  if (of.claimed.empty()) out.reserve(of.most, wanted);
  for (std::size_t i = 0; i < of.components.size(); ++i) {
    if (of.components[i] == 0 || (!kept.empty() && !kept[i])) continue;
    if (of.claimed.empty()) {
      out.add(of.components[i], of.squares[i]);
      continue;
    }
    const auto most = static_cast<std::size_t>(of.most);
    const ObservedRow row{std::span(of.squares).subspan(i * most, most), std::span(of.claimed).subspan(i * most, most),
                          of.components[i]};
    double claimed = 0;
    double sum = 0;
    for (std::size_t c = 0; c < most; ++c) {
      if (std::isnan(row.squares[c])) continue;
      sum += row.squares[c];
      claimed += row.claimed[c];
    }
    if (claimed > 0) {
      out.add(row);
    } else {
      out.add(row.components, sum);
    }
  }
  return out;
}

Eigen::Index RowErrors::number_count(int observation) const {
  Eigen::Index sum = 0;
  for (const std::uint16_t count : of_[static_cast<std::size_t>(observation)].components) sum += count;
  return sum;
}

RowWeight RowErrors::whitened(Eigen::Index i, const CommonNoise& tau) const {
  RowWeight out;
  for (std::size_t k = 0; k < of_.size(); ++k) {
    const Observed& of = of_[k];
    const int known = of.components[static_cast<std::size_t>(i)];
    if (known == 0) continue;
    out.components += known;
    const double variance = tau[k] * tau[k];
    if (of.claimed.empty()) {
      out.squared += of.squares[static_cast<std::size_t>(i)] / variance;
      continue;
    }
    for (auto at = static_cast<std::size_t>(i * of.most); at < static_cast<std::size_t>((i + 1) * of.most); ++at) {
      if (!std::isnan(of.squares[at])) out.squared += of.squares[at] / (of.claimed[at] + variance);
    }
  }
  return out;
}

double RowErrors::claimed_variance(int observation) const {
  double sum = 0;
  for (const double variance : of_[static_cast<std::size_t>(observation)].claimed) sum += variance;
  return sum;
}

int RowErrors::most_numbers() const {
  int sum = 0;
  for (const Observed& of : of_) sum += of.most;
  return sum;
}

double RowErrors::cost(const Weighting& weighting) const {
  const auto loss = losses(weighting.loss, most_numbers());
  double cost = 0;
  sum_rows(
      0.0,
      [&](double& sum, Eigen::Index i) {
        const RowWeight row = whitened(i, weighting.tau);
        if (row.components > 0) sum += 0.5 * loss[static_cast<std::size_t>(row.components)]->rho(row.squared);
      },
      [&](double sum) { cost += sum; });
  return cost;
}

std::vector<RowWeight> RowErrors::weights(const Weighting& weighting) const {
  const auto loss = losses(weighting.loss, most_numbers());
  std::vector<RowWeight> out(static_cast<std::size_t>(rows_));
  each_row([&](Eigen::Index i) {
    RowWeight row = whitened(i, weighting.tau);
    row.weight = row.components == 0 ? 0 : loss[static_cast<std::size_t>(row.components)]->weight(row.squared);
    out[static_cast<std::size_t>(i)] = row;
  });
  return out;
}

}  // namespace fastcal
