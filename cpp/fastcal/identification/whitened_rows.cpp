// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/whitened_rows.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/kernels/normal_sums.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {
namespace {

/// Residuals of points need the tool's pose alone.
RowBlock::Frames looked_at(const Problem& problem, const std::vector<int>& free) {
  const auto& observations = problem.measured.observations();
  const bool points = observations.size() == 1 && observations.front()->coordinates() != nullptr;
  return points && free.empty() ? RowBlock::Frames::kTool : RowBlock::Frames::kAll;
}

}  // namespace

double whitening_deviation(const Problem& problem, const CommonNoise& tau, Eigen::Index i, int number) {
  const double own = problem.measured.sigma(i, number);
  const double common = tau[problem.measured.observation_of(number)];
  return own == 0 ? common : std::sqrt(own * own + common * common);
}

Eigen::Index rows_at_once(int numbers) {
  constexpr Eigen::Index kNumbers = 1600;
  return std::clamp<Eigen::Index>(kNumbers / numbers / kernels::kGroup * kernels::kGroup, kernels::kGroup, kChunkRows);
}

WhitenedRows::WhitenedRows(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                           const Eigen::VectorXd& scale, const CommonNoise& tau)
    : problem_(problem),
      free_(free),
      scale_(scale),
      tau_(tau),
      block_(problem.model, theta.head(problem.model.parameter_count()), free, scale, looked_at(problem, free)),
      unknowns_(theta.tail(problem.measured.unknown_count())),
      count_(problem.measured.number_count()),
      coordinates_(problem.measured.observations().front()->coordinates()),
      column_of_(static_cast<std::size_t>(problem.measured.unknown_count()), -1) {
  for (std::size_t k = 0; k < free.size(); ++k) {
    const int unknown = free[k] - problem.model.parameter_count();
    if (unknown >= 0) column_of_[static_cast<std::size_t>(unknown)] = static_cast<int>(k);
  }
  for (const PlacedObservation& of : problem.measured.observations()) {
    inverse_.resize(of.first_number + of.component_count,
                    of->claims_sigma() ? 0.0 : 1 / tau[problem.measured.observation_of(of.first_number)]);
    if (coordinates_ != nullptr && of.first_number == 0) continue;
    for (int c = 0; c < of.component_count; ++c) {
      for (const int frame : of.frames) sights_.push_back({of.first_number + c, frame, nullptr});
    }
  }
  if (const LoadResponse* response = problem.response)
    along_ = response->directions.transpose() * (theta - response->origin);
}

void WhitenedRows::evaluate(Eigen::Index begin, Eigen::Index end) {
  begin_ = begin;
  rows_ = static_cast<int>(end - begin);
  is_flattened_ = false;
  block_.forward(problem_.samples, begin, end, rows_at_once(count_) < kChunkRows ? nullptr : problem_.memory);
  const Eigen::Index stride = block_.stride();
  const auto fresh = [stride](AlignedNumbers& numbers, Eigen::Index count) {
    double* first = numbers.resize(count * stride);
    std::fill(first, first + count * stride, 0.0);
    return first;
  };
  fresh(residual_, count_);
  fresh(factor_, count_);
  if (!sights_.empty()) {
    double* slope = fresh(slope_, 6 * static_cast<Eigen::Index>(sights_.size()));
    for (kernels::Sight& sight : sights_) {
      sight.slope = slope;
      slope += 6 * stride;
    }
  }
  if (problem_.measured.unknown_count() > 0) {
    by_unknown_.resize(kMostUnknowns * count_ * stride);
    own_.assign(count_ * stride, {});
  }
  weights_.assign(rows_, {});
  if (compare_points()) return;
  for (int i = 0; i < rows_; ++i) compare(i);
}

bool WhitenedRows::compare_points() {
  if (coordinates_ == nullptr || count_ != 3 || !(inverse_[0] > 0)) return false;
  const double inverse = inverse_[0];
  for (int c = 0; c < 3; ++c) {
    double* r = at(residual_, c);
    double* factor = at(factor_, c);
    for (int i = 0; i < rows_; ++i) r[i] = block_.position(i, c) - (*coordinates_)(begin_ + i, c);
    for (Eigen::Index k = 0; k < along_.size(); ++k) {
      const RowMatrixXd& change = problem_.response->change[static_cast<std::size_t>(k)];
      for (int i = 0; i < rows_; ++i) r[i] += change(begin_ + i, c) * along_[k];
    }
    for (int i = 0; i < rows_; ++i) {
      const bool present = r[i] == r[i];
      r[i] = present ? r[i] : 0;
      factor[i] = present ? inverse : 0;
      const double u = r[i] * factor[i];
      weights_[i].squared += u * u;
      weights_[i].components += present;
    }
  }
  return true;
}

double* WhitenedRows::jacobian() {
  const auto p = static_cast<Eigen::Index>(free_.size());
  double* J = J_.resize((p + 1) * ld());
  const auto tool = coordinates_ != nullptr ? kernels::ToolNumbers::kPosition : kernels::ToolNumbers::kNone;
  block_.jacobian(
      {tool, count_ - static_cast<int>(tool), factor_.data(), sights_.data(), static_cast<int>(sights_.size())}, J,
      ld());
  if (unknowns_.size() > 0) unknown_columns(J);
  if (along_.size() > 0) response_columns(J);
  Eigen::Map<Eigen::ArrayXd>(J + p * ld(), height()) = Eigen::Map<const Eigen::ArrayXd>(residual_.data(), height()) *
                                                       Eigen::Map<const Eigen::ArrayXd>(factor_.data(), height());
  return J;
}

void WhitenedRows::flatten(int i, double weight, double slope) {
  constexpr double kNoWeight = 1e-12;  // the curvature is as small
  const double square = weights_[i].squared;
  if (!(slope > 0 && weight > kNoWeight && square > 0)) return;
  if (!is_flattened_) {
    double* turn = turn_.resize(count_ * block_.stride());
    std::fill(turn, turn + count_ * block_.stride(), 0.0);
    is_flattened_ = true;
  }
  const double factor = std::sqrt(slope / square) / weight;
  for (int n = 0; n < count_; ++n) at(turn_, n)[i] = factor * at(residual_, n)[i] * at(factor_, n)[i];
}

Eigen::VectorXd WhitenedRows::weighted_residuals(const std::vector<const Loss*>& loss) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(height());
  for (int i = 0; i < rows_; ++i) {
    const RowWeight& row = weights_[i];
    if (row.components == 0) continue;
    const double weight = loss[row.components]->weight(row.squared);
    for (int n = 0; n < count_; ++n)
      out[place(i, n)] = weight * residual_.data()[place(i, n)] * factor_.data()[place(i, n)];
  }
  return out;
}

const double* WhitenedRows::along_residuals(const double* J) {
  const auto p = static_cast<int>(free_.size());
  double* out = along_residuals_.resize(static_cast<Eigen::Index>(p) * ld());
  kernels::add_parts(J, ld(), stride(), count_, p, turn_.data(), out);
  return out;
}

void WhitenedRows::add(int i, int number, double r) {
  const Eigen::Index row = begin_ + i;
  for (Eigen::Index k = 0; k < along_.size(); ++k) r += problem_.response->change[k](row, number) * along_[k];
  const double inverse = inverse_[number] > 0 ? inverse_[number] : 1 / whitening_deviation(problem_, tau_, row, number);
  at(residual_, number)[i] = r;
  at(factor_, number)[i] = inverse;
  RowWeight& weight = weights_[i];
  weight.squared += r * r * inverse * inverse;
  ++weight.components;
}

void WhitenedRows::compare(int i) {
  const Eigen::Index row = begin_ + i;
  const Eigen::Index stride = block_.stride();
  if (coordinates_ != nullptr) {
    for (int c = 0; c < 3; ++c) {
      const double measured = (*coordinates_)(row, c);
      if (!std::isnan(measured)) add(i, c, block_.position(i, c) - measured);
    }
  }
  kernels::Sight* sight = sights_.data();
  for (const PlacedObservation& of : problem_.measured.observations()) {
    if (coordinates_ != nullptr && of.first_number == 0) continue;
    const Sights sights = sights_of(of, [&](int frame) { return block_.frame(frame, i); });
    const auto frames = static_cast<int>(of.frames.size());
    const int components = of.component_count / of->reading_count();
    const bool has_unknowns = of.unknown_count > 0;
    comparison_.clear(of.frames.size(), has_unknowns);
    of->compare_all(row, sights, unknowns_.data() + of.first_unknown, comparison_, [&](int reading) {
      for (int c = 0; c < components; ++c) {
        if (!comparison_.present[c]) continue;
        const int number = reading * components + c;
        for (int f = 0; f < frames; ++f) {
          double* slope = slope_.data() + (sight[number * frames + f].slope - slope_.data()) + i;
          for (int k = 0; k < 6; ++k) slope[k * stride] = comparison_.by_frame[f](c, k);
        }
        add(i, of.first_number + number, comparison_.r[c]);
        const int unknowns = comparison_.unknown_count + comparison_.second_count;
        if (unknowns == 0) continue;
        const Eigen::Index at = place(i, of.first_number + number);
        own_[at] = {of.first_unknown + comparison_.first_unknown, comparison_.unknown_count,
                    of.first_unknown + comparison_.second_unknown, unknowns};
        double* by = by_unknown_.data() + kMostUnknowns * at;
        for (int k = 0; k < unknowns; ++k) by[k] = comparison_.by_unknown(c, k);
      }
      comparison_.clear(of.frames.size(), has_unknowns);
    });
    sight += of.component_count * frames;
  }
}

void WhitenedRows::unknown_columns(double* J) {
  for (int n = 0; n < count_; ++n) {
    const OwnUnknowns* own = own_.data() + place(0, n);
    const double* factor = at(factor_, n);
    for (int i = 0, end = 0; i < rows_; i = end) {  // rows that depend on the same ones
      while (end < rows_ && own[end] == own[i]) ++end;
      for (int k = 0; k < own[i].count; ++k) {
        const int column = column_of_[static_cast<std::size_t>(own[i].unknown(k))];
        if (column < 0) continue;
        const double* by = by_unknown_.data() + kMostUnknowns * place(0, n) + k;
        double* out = J + static_cast<Eigen::Index>(column) * ld() + place(0, n);
        for (int row = i; row < end; ++row) out[row] = by[kMostUnknowns * row] * factor[row] * scale_[column];
      }
    }
  }
}

std::vector<WhitenedRows::Part> WhitenedRows::parts() const {
  const int p = static_cast<int>(free_.size());
  std::vector<Part> out;
  const OwnUnknowns* before = nullptr;
  bool before_alike = true;
  for (int n = 0; n < count_; ++n) {
    const OwnUnknowns* own = nullptr;  // of the first row that has some
    bool alike = true;
    for (int i = 0; i < rows_ && !own_.empty(); ++i) {
      const OwnUnknowns& here = own_[static_cast<std::size_t>(place(i, n))];
      if (here.count == 0) continue;
      if (own == nullptr) own = &here;
      alike = alike && here == *own;
    }
    const bool same = own == nullptr || (before != nullptr && alike == before_alike && (!alike || *own == *before));
    if (n > 0 && same) {
      out.back().end = n + 1;
      continue;
    }
    std::vector<bool> used(column_of_.size(), !alike);
    for (int k = 0; own != nullptr && k < own->count; ++k) used[static_cast<std::size_t>(own->unknown(k))] = true;
    Part& part = out.emplace_back(Part{n, n + 1, {}});
    for (int k = 0; k < p; ++k) {
      const int unknown = free_[static_cast<std::size_t>(k)] - problem_.model.parameter_count();
      if (unknown < 0 || used[static_cast<std::size_t>(unknown)]) part.columns.push_back(k);
    }
    part.columns.push_back(p);
    before = own;
    before_alike = alike;
  }
  return out;
}

void WhitenedRows::response_columns(double* J) {
  const Eigen::Index stride = block_.stride();
  const Eigen::Index plane = count_ * stride;  // whitened numbers of all rows
  double* change = change_.resize(along_.size() * plane);
  std::fill(change, change + along_.size() * plane, 0.0);
  for (Eigen::Index d = 0; d < along_.size(); ++d) {
    const RowMatrixXd& of = problem_.response->change[static_cast<std::size_t>(d)];
    for (int n = 0; n < count_; ++n) {
      double* out = change + d * plane + n * stride;
      for (int i = 0; i < rows_; ++i) {
        if (at(factor_, n)[i] != 0) out[i] = of(begin_ + i, n) * at(factor_, n)[i];
      }
    }
  }
  for (std::size_t k = 0; k < free_.size(); ++k) {
    Eigen::Map<Eigen::ArrayXd> column(J + static_cast<Eigen::Index>(k) * ld(), plane);
    for (Eigen::Index d = 0; d < along_.size(); ++d) {
      const double along = problem_.response->directions(free_[k], d) * scale_[static_cast<Eigen::Index>(k)];
      if (along != 0) column += along * Eigen::Map<const Eigen::ArrayXd>(change + d * plane, plane);
    }
  }
}

}  // namespace fastcal
