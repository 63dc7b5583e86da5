// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/loop_block.hpp"

#include <algorithm>

#include "fastcal/math/pivoted_lu.hpp"
#include "fastcal/model/gathered_twists.hpp"

namespace fastcal {

LoopBlock::LoopBlock(const Chain& chain) : chain_(chain), assembler_(chain) {}

void LoopBlock::close(double* joints, int rows, int stride, const std::function<const Twists*(int)>& twists) {
  const int n = chain_.joint_count();
  const int m = passive_count();
  rows_ = rows;
  stride_ = stride;
  equations_.resize(static_cast<std::size_t>(rows));
  double* slopes = slopes_.resize(static_cast<Eigen::Index>(12) * m * stride);
  double* along = along_.resize(static_cast<Eigen::Index>(6) * m * stride);
  std::fill_n(slopes, 12 * m * stride, 0.0);
  std::fill_n(along, 6 * m * stride, 0.0);
  double* ones = ones_.resize(static_cast<Eigen::Index>(m) * stride);
  std::fill_n(ones, m * stride, 1.0);
  std::vector<double> q(static_cast<std::size_t>(n));
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < n; ++j) q[static_cast<std::size_t>(j)] = joints[j * stride + i];
    const Twists* xi = twists(i);
    assembler_.close(q.data(), xi);
    for (const int joint : chain_.passive) joints[joint * stride + i] = q[static_cast<std::size_t>(joint)];
    equations_[static_cast<std::size_t>(i)] = assembler_.rows();
    for (int r = 0; r < m; ++r) {
      const LoopRow& row = assembler_.rows()[static_cast<std::size_t>(r)];
      for (int k = 0; k < 6; ++k) {
        slopes[(12 * r + k) * stride + i] = row.by_target[k];
        slopes[(12 * r + 6 + k) * stride + i] = row.by_sensor[k];
      }
    }
    for (int p = 0; p < m; ++p) {
      const int joint = chain_.passive[static_cast<std::size_t>(p)];
      const Vector6d axis = joint_axis(chain_, joint, xi);
      for (int k = 0; k < 6; ++k) along[(6 * p + k) * stride + i] = axis[k];
    }
  }
  sights_.clear();
  for (int r = 0; r < m && rows > 0; ++r) {
    const View& view = equations_.front()[static_cast<std::size_t>(r)].frames;
    // The kernel wants a look of each number, if only with slopes of 0.
    if (view.target == kWorldFrame && view.sensor == kWorldFrame)
      sights_.push_back({r, kBaseFrame, slopes + 12 * r * stride});
    if (view.target != kWorldFrame) sights_.push_back({r, view.target, slopes + 12 * r * stride});
    if (view.sensor != kWorldFrame) sights_.push_back({r, view.sensor, slopes + (12 * r + 6) * stride});
  }
}

void LoopBlock::add_twists(int first_column, std::vector<kernels::TwistRows>& to) const {
  for (int p = 0; p < passive_count(); ++p) {
    const int frame = chain_.tree->frame_of_joint(chain_.passive[static_cast<std::size_t>(p)]);
    kernels::TwistRows& twist =
        to.emplace_back(kernels::TwistRows{frame, frame, first_column + p, false, 1, 0, {}, chain_.tree->end(frame)});
    for (int k = 0; k < 6; ++k) {
      const double* rows = along_.data() + static_cast<Eigen::Index>(6 * p + k) * stride_;
      if (std::any_of(rows, rows + rows_, [](double v) { return v != 0; })) add_term(k, 0, rows, twist);
    }
  }
}

kernels::NumberRows LoopBlock::numbers() const {
  return {kernels::ToolNumbers::kNone, passive_count(), ones_.data(), sights_.data(), static_cast<int>(sights_.size())};
}

void LoopBlock::add_own(const Wanted& wanted, int first_passive, double* columns, int ld) const {
  for (int i = 0; i < rows_; ++i) {
    for (int r = 0; r < passive_count(); ++r) {
      for (const auto& [parameter, by] :
           equations_[static_cast<std::size_t>(i)][static_cast<std::size_t>(r)].by_parameter) {
        const auto& [column, scale] = wanted[static_cast<std::size_t>(parameter)];
        if (column >= 0) columns[static_cast<Eigen::Index>(column) * ld + r * stride_ + i] += scale * by;
      }
    }
  }
  for (int r = 0; r < passive_count() && rows_ > 0; ++r) {
    for (const auto& [joint, share] : equations_.front()[static_cast<std::size_t>(r)].by_turn) {
      const auto place = std::find(chain_.passive.begin(), chain_.passive.end(), joint);
      if (place == chain_.passive.end()) continue;
      double* column =
          columns + (first_passive + (place - chain_.passive.begin())) * static_cast<Eigen::Index>(ld) + r * stride_;
      for (int i = 0; i < rows_; ++i) column[i] += share;
    }
  }
}

void LoopBlock::add_turn(int joint, double scale, const double* by, double* column) const {
  for (int r = 0; r < passive_count() && rows_ > 0; ++r) {
    for (const auto& [other, share] : equations_.front()[static_cast<std::size_t>(r)].by_turn) {
      for (int i = 0; other == joint && i < rows_; ++i) column[r * stride_ + i] += scale * share * by[i];
    }
  }
}

void LoopBlock::add_rod(int rod, double scale, const double* by, double* column) const {
  for (int r = 0; r < passive_count() && rows_ > 0; ++r) {
    if (equations_.front()[static_cast<std::size_t>(r)].rod != rod) continue;
    for (int i = 0; i < rows_; ++i) column[r * stride_ + i] -= scale * by[i];
  }
}

void LoopBlock::eliminate(int count, int numbers, double* block, int ld, double* equations, int equations_ld) const {
  const int m = passive_count();
  Eigen::MatrixXd C(m, m), by(m, count), seen(numbers, m);
  for (int i = 0; i < rows_; ++i) {
    for (int r = 0; r < m; ++r) {
      for (int p = 0; p < m; ++p)
        C(r, p) = equations[static_cast<Eigen::Index>(count + p) * equations_ld + r * stride_ + i];
      for (int c = 0; c < count; ++c)
        by(r, c) = equations[static_cast<Eigen::Index>(c) * equations_ld + r * stride_ + i];
    }
    for (int n = 0; n < numbers; ++n) {
      for (int p = 0; p < m; ++p) seen(n, p) = block[static_cast<Eigen::Index>(count + p) * ld + n * stride_ + i];
    }
    const Eigen::MatrixXd moved = seen * solve(Eigen::FullPivLU<Eigen::MatrixXd>(C), by);
    for (int c = 0; c < count; ++c) {
      for (int n = 0; n < numbers; ++n) block[static_cast<Eigen::Index>(c) * ld + n * stride_ + i] -= moved(n, c);
    }
  }
}

}  // namespace fastcal
