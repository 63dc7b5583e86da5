// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A RowBlock's rows where the robot has closed loops.
#include <algorithm>
#include <initializer_list>

#include "fastcal/model/row_block.hpp"

namespace fastcal {

void RowBlock::jacobian(const kernels::NumberRows& numbers, double* block, int ld) {
  if (!loops_) return open_jacobian(numbers, block, ld);
  const int count = static_cast<int>(free_count_);
  double* open = open_.resize(static_cast<Eigen::Index>(column_count()) * ld);
  open_jacobian(numbers, open, ld);
  const int height = loops_->passive_count() * stride_;
  double* equations = equations_.resize(static_cast<Eigen::Index>(column_count()) * height);
  open_jacobian(loops_->numbers(), equations, height);
  loops_->add_own(wanted_, count, equations, height);
  add_turns(equations, height);
  loops_->eliminate(count, static_cast<int>(numbers.tool) + numbers.others, open, ld, equations, height);
  std::copy_n(open, static_cast<Eigen::Index>(count) * ld, block);
}

void RowBlock::close_loops() {
  Twists xi;
  loops_->close(joints_.data(), rows_, stride_, [&](int i) -> const Twists* {
    if (std::none_of(moved_.begin(), moved_.end(), [](bool moved) { return moved; })) return nullptr;
    xi = Twists::Zero(6, chain_.twist_count());
    for (int f = 0; f < chain_.twist_count(); ++f) {
      const auto k = static_cast<std::size_t>(f);
      if (tilted_[k])
        xi.col(f) = frame_twist(f, i);
      else if (moved_[k])
        xi(5, f) = frame_xi_[k].data()[5 * stride_ + i];
    }
    return &xi;
  });
}

void RowBlock::add_turns(double* equations, int ld) const {
  const std::initializer_list<const TwistTable*> tables{table_, &other_table_};
  for (const TwistTable* table : tables) {
    for (const TwistTable::Entry& entry : table->entries()) {
      const auto& [column, scale] = wanted_[static_cast<std::size_t>(entry.parameter)];
      if (entry.values.empty() || column < 0) continue;
      double* to = equations + static_cast<Eigen::Index>(column) * ld;
      if (entry.frame >= frame_count()) {
        if (const double* longer = entry.part(kAlongRod, stride_)) loops_->add_rod(entry.frame, scale, longer, to);
        continue;
      }
      const int joint = chain_.tree->joint(entry.frame);
      if (joint < 0) continue;
      const int part = chain_.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2;
      const double* rows = entry.part(part, stride_);
      if (rows != nullptr) loops_->add_turn(joint, scale, rows, to);
    }
  }
}

void RowBlock::write_closed_jacobian(int of, int numbers, double* out) {
  AlignedNumbers factor, slopes, block;
  std::fill_n(factor.resize(static_cast<Eigen::Index>(numbers) * stride_), numbers * stride_, 1.0);
  std::fill_n(slopes.resize(static_cast<Eigen::Index>(6) * numbers * stride_), 6 * numbers * stride_, 0.0);
  std::vector<kernels::Sight> sights;
  for (int k = 0; k < numbers; ++k) {
    double* slope = slopes.data() + static_cast<Eigen::Index>(6) * k * stride_;
    std::fill_n(slope + k * stride_, stride_, 1.0);
    sights.push_back({k, of, slope});
  }
  const int ld = numbers * stride_;
  const auto count = static_cast<Eigen::Index>(free_count_);
  jacobian({kernels::ToolNumbers::kNone, numbers, factor.data(), sights.data(), numbers}, block.resize(count * ld), ld);
  for (int i = 0; i < rows_; ++i) {
    for (int k = 0; k < numbers; ++k) {
      for (Eigen::Index c = 0; c < count; ++c)
        out[(static_cast<Eigen::Index>(i) * numbers + k) * count + c] = block.data()[c * ld + k * stride_ + i];
    }
  }
}

}  // namespace fastcal
