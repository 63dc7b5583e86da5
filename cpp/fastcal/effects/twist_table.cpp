// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/effects/twist_table.hpp"

#include <algorithm>

namespace fastcal {

void TwistTable::clear(int stride) {
  stride_ = stride;
  first_ = 0;
  for (Entry& entry : entries_) {
    entry.place.fill(-1);
    entry.values.clear();
  }
}

std::size_t TwistTable::find(int parameter, int frame, std::size_t at) {
  const auto same = [&](const Entry& entry) { return entry.parameter == parameter && entry.frame == frame; };
  if (at < entries_.size() && same(entries_[at])) return at;
  at = static_cast<std::size_t>(std::find_if(entries_.begin(), entries_.end(), same) - entries_.begin());
  if (at == entries_.size()) entries_.push_back({parameter, frame, {-1, -1, -1, -1, -1, -1}, {}});
  return at;
}

double* TwistTable::rows(Entry& entry, std::size_t k) const {
  const auto stride = static_cast<std::size_t>(stride_);
  int& place = entry.place[k];
  if (place < 0) {
    place = static_cast<int>(entry.values.size() / stride);
    entry.values.resize(entry.values.size() + stride, 0.0);
  }
  return entry.values.data() + static_cast<std::size_t>(place) * stride;
}

void TwistTable::add(const TwistColumns& columns, int row) {
  std::size_t at = 0;  // effects give their columns in the same order in most rows
  for (const Chain::Column& column : columns) {
    at = find(first_ + column.parameter, column.frame, at);
    for (std::size_t k = 0; k < 6; ++k) {
      const double xi = column.xi.data()[k];
      if (xi != 0) rows(entries_[at], k)[row] += xi;
    }
    ++at;
  }
}

double* TwistTable::part(int parameter, int frame, int k) {
  return rows(entries_[find(first_ + parameter, frame, 0)], static_cast<std::size_t>(k));
}

std::size_t TwistTable::bytes() const {
  std::size_t sum = 0;
  for (const Entry& entry : entries_) sum += sizeof(Entry) + sizeof(double) * entry.values.size();
  return sum;
}

}  // namespace fastcal
