// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/gathered_twists.hpp"

#include <algorithm>
#include <utility>

namespace fastcal {
namespace {

/// One shift or turn, the same in all rows.
bool is_unit(const kernels::TwistRows& twist) {
  return twist.term_count == 1 && twist.terms[0].rows == nullptr && !twist.adds;
}

/// The frame that a twist is looked at in: a shift along z or a turn about it is the same in the next frame where the
/// way there keeps the axis z, as past a joint, which halves the frames of an arm.
int frame_of(const kernels::TwistRows& twist, const std::vector<kernels::FrameRows>& chain) {
  const int next = twist.frame + 1;
  const bool is_last = next == static_cast<int>(chain.size());
  if (twist.frame < 0 || is_last || !is_unit(twist) || twist.terms[0].axis != 2) return twist.frame;
  const kernels::FrameRows& frame = chain[static_cast<std::size_t>(next)];
  if (frame.branches_off) return twist.frame;
  const bool keeps_z = frame.constant_turn == kernels::Turn::kNone || frame.constant_turn == kernels::Turn::kAboutZ;
  const bool is_on_it = frame.constant[9] == 0 && frame.constant[10] == 0;
  return keeps_z && is_on_it && frame.motion == nullptr ? next : twist.frame;
}

}  // namespace

void add_term(int k, double size, const double* rows, kernels::TwistRows& twist) {
  twist.terms[twist.term_count++] = {k % 3, k >= 3, twist.scale * size, rows};
}

bool only_turns_about_z(const kernels::TwistRows& twist) {
  return std::all_of(twist.terms, twist.terms + twist.term_count,
                     [](const kernels::TwistTerm& term) { return term.turns && term.axis == 2; });
}

void put_in_order(std::vector<kernels::TwistRows>& twists, std::vector<bool>& unmoved) {
  std::stable_sort(twists.begin(), twists.end(), [](const auto& a, const auto& b) { return a.frame < b.frame; });
  for (kernels::TwistRows& twist : twists) {
    const auto column = static_cast<std::size_t>(twist.column);
    twist.adds = !unmoved[column];
    unmoved[column] = false;
  }
}

void GatheredTwists::gather(const std::vector<kernels::TwistRows>& geometry,
                            const std::vector<kernels::TwistRows>& moving, const std::vector<kernels::FrameRows>& chain,
                            std::size_t columns) {
  std::vector<bool> is_sum(columns);
  for (const auto* some : {&geometry, &moving}) {
    for (const kernels::TwistRows& twist : *some) is_sum[static_cast<std::size_t>(twist.column)] = twist.adds;
  }
  std::vector<std::pair<int, const kernels::TwistRows*>> twists;
  for (const auto* some : {&geometry, &moving}) {
    for (const kernels::TwistRows& twist : *some) {  // the first of a sum has to stay before the others
      const bool stays = is_sum[static_cast<std::size_t>(twist.column)];
      twists.emplace_back(stays ? twist.frame : frame_of(twist, chain), &twist);
    }
  }
  std::stable_sort(twists.begin(), twists.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  others_.clear();
  others_.reserve(twists.size());  // frames_ point into it
  frames_.clear();
  for (const auto& [frame, twist] : twists) {
    if (frames_.empty() || frames_.back().frame != frame)
      frames_.push_back({frame, {}, others_.data() + others_.size(), 0});
    kernels::FrameTwists& here = frames_.back();
    const kernels::TwistTerm& term = twist->terms[0];
    kernels::FrameTwists::Unit& unit = here.units[3 * term.turns + term.axis];
    if (is_unit(*twist) && unit.column < 0) {
      unit = {twist->column, twist->first_moved, term.size, twist->end_moved};
    } else {
      others_.push_back(twist);
      ++here.other_count;
    }
  }
}

}  // namespace fastcal
