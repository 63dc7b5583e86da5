// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/row_block.hpp"

#include <algorithm>

#include "fastcal/math/se3.hpp"

namespace fastcal {
namespace {

void write(const Pose& pose, double* out, Eigen::Index step) {
  for (int k = 0; k < 9; ++k) out[k * step] = pose.R(k % 3, k / 3);
  for (int k = 0; k < 3; ++k) out[(9 + k) * step] = pose.p[k];
}

}  // namespace

RowBlock::RowBlock(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta,
                   const std::vector<int>& free, const Eigen::VectorXd& scale)
    : model_(model),
      theta_(theta),
      chain_(model.robot().chain(theta.head(model.robot().nominal().size()))),
      wanted_(static_cast<std::size_t>(model.parameter_count()), {-1, 0.0}),
      free_count_(free.size()),
      xi_(Twists::Zero(6, chain_.frame_count())),
      moved_(static_cast<std::size_t>(frame_count())),
      general_(moved_),
      frame_xi_(moved_.size()),
      angle_(moved_.size()),
      motion_(moved_.size()),
      frames_(moved_.size()) {
  for (std::size_t k = 0; k < free.size(); ++k) {
    if (free[k] < model.parameter_count())
      wanted_[static_cast<std::size_t>(free[k])] = {static_cast<int>(k), scale[static_cast<Eigen::Index>(k)]};
  }
  for (std::size_t f = 0; f < frames_.size(); ++f) write(chain_.constants[f], frames_[f].constant, 1);
}

void RowBlock::forward(const Samples& samples, Eigen::Index begin, Eigen::Index end, bool with_columns) {
  const auto rows = static_cast<int>(end - begin);
  stride_ = (rows + kernels::kGroup - 1) / kernels::kGroup * kernels::kGroup;
  std::fill(moved_.begin(), moved_.end(), false);
  std::fill(general_.begin(), general_.end(), false);
  if (!model_.effects().empty()) ask_effects(samples, begin, end, with_columns);
  for (int f = 0; f < frame_count(); ++f) {
    const auto k = static_cast<std::size_t>(f);
    kernels::FrameRows& frame = frames_[k];
    frame.slide = frame.turn = frame.motion = nullptr;
    const bool joint = f % 2 == 1 && f < frame_count() - 1;
    if (!joint && !moved_[k]) continue;
    const double* xi = frame_xi_[k].data();
    const bool turned = moved_[k] && !general_[k];
    double* angle = angle_[k].resize(2 * stride_);
    double* shift = angle + stride_;
    std::fill(angle, angle + 2 * stride_, 0.0);
    const bool revolute = joint && chain_.joint_types[static_cast<std::size_t>(f / 2)] == JointType::kRevolute;
    for (int i = 0; joint && i < rows; ++i) (revolute ? angle : shift)[i] = samples.q(begin + i, f / 2);
    for (int i = 0; turned && i < rows; ++i) angle[i] += xi[5 * stride_ + i];
    if (revolute || turned) frame.turn = angle;
    if (joint && !revolute) frame.slide = shift;
    if (general_[k]) {
      general_motion(f, rows);
      frame.motion = motion_[k].data();
    }
    if (moved_[k]) turn_columns(f, rows);
  }
  double* poses = poses_.resize(static_cast<Eigen::Index>(frame_count()) * kernels::kPoseNumbers * stride_);
  kernels::forward_rows(frames_.data(), frame_count(), stride_, poses);
}

void RowBlock::ask_effects(const Samples& samples, Eigen::Index begin, Eigen::Index end, bool with_columns) {
  for (EffectTwist& twist : twists_) twist.parts = 0;
  for (Eigen::Index row = begin; row < end; ++row) {
    const auto i = static_cast<int>(row - begin);
    const State state = samples.row(row);
    xi_.setZero();
    columns_.clear();
    int first = static_cast<int>(model_.robot().nominal().size());
    for (const auto& effect : model_.effects()) {
      const std::size_t before = columns_.size();
      effect->deflect(state, theta_.data() + first, xi_, with_columns ? &columns_ : nullptr);
      for (std::size_t c = before; c < columns_.size(); ++c) columns_[c].parameter += first;
      first += static_cast<int>(effect->parameters().size());
    }
    for (int f = 0; f < frame_count(); ++f) {
      const auto k = static_cast<std::size_t>(f);
      const auto xi = xi_.col(f);
      if (xi.cwiseAbs().sum() == 0) continue;
      double* to = frame_xi_[k].data();
      if (!moved_[k]) {
        to = frame_xi_[k].resize(6 * stride_);
        std::fill(to, to + 6 * stride_, 0.0);
        moved_[k] = true;
      }
      if (!is_turn_about_z(xi)) general_[k] = true;
      for (int part = 0; part < 6; ++part) to[part * stride_ + i] = xi[part];
    }
    keep(columns_, i);
  }
}

void RowBlock::keep(const TwistColumns& columns, int i) {
  std::size_t at = 0;  // effects give their columns in the same order in most rows
  for (const Chain::Column& column : columns) {
    if (wanted_[static_cast<std::size_t>(column.parameter)].first < 0) continue;
    const auto same = [&column](const EffectTwist& twist) {
      return twist.parameter == column.parameter && twist.frame == column.frame;
    };
    if (at >= twists_.size() || !same(twists_[at]))
      at = static_cast<std::size_t>(std::find_if(twists_.begin(), twists_.end(), same) - twists_.begin());
    if (at == twists_.size()) twists_.push_back({column.parameter, column.frame, 0, {}});
    EffectTwist& twist = twists_[at++];
    double* xi = twist.xi.resize(6 * stride_);
    for (int k = 0; k < 6; ++k) {
      if (column.xi[k] == 0) continue;
      if ((twist.parts >> k & 1U) == 0) std::fill(xi + k * stride_, xi + (k + 1) * stride_, 0.0);
      twist.parts |= 1U << k;
      xi[k * stride_ + i] += column.xi[k];
    }
  }
}

void RowBlock::general_motion(int frame, int rows) {
  const auto k = static_cast<std::size_t>(frame);
  double* motion = motion_[k].resize(kernels::kPoseNumbers * stride_);
  const Pose none;
  for (int i = 0; i < stride_; ++i) write(i < rows ? exp_se3(frame_twist(frame, i)) : none, motion + i, stride_);
}

void RowBlock::turn_columns(int frame, int rows) {
  constexpr unsigned kTurnAboutZ = 1U << 5;
  for (EffectTwist& twist : twists_) {
    const bool same = !general_[static_cast<std::size_t>(frame)] && (twist.parts & ~kTurnAboutZ) == 0;
    if (twist.frame != frame || twist.parts == 0 || same) continue;
    for (int part = 0; part < 6; ++part) {
      double* own = twist.xi.data() + part * stride_;
      if ((twist.parts >> part & 1U) == 0) std::fill(own, own + stride_, 0.0);
    }
    twist.parts = 63;
    for (int i = 0; i < rows; ++i) {
      Eigen::Map<Vector6d, 0, Eigen::InnerStride<>> own(twist.xi.data() + i, Eigen::InnerStride<>(stride_));
      const Vector6d here = frame_twist(frame, i);
      if (!here.isZero(0)) own = (right_jacobian_se3(here) * own).eval();
    }
  }
}

Pose RowBlock::tool(int i) const {
  Pose out;
  for (int k = 0; k < 9; ++k) out.R(k % 3, k / 3) = pose_part(frame_count() - 1, i, k);
  for (int k = 0; k < 3; ++k) out.p[k] = position(i, k);
  return out;
}

void RowBlock::jacobian(const kernels::NumberRows& numbers, double* block, int ld) {
  std::vector<kernels::TwistRows> twists;
  const auto add = [&](int parameter, int frame, const double* xi, const double* by_row, unsigned parts) {
    const auto& [column, scale] = wanted_[static_cast<std::size_t>(parameter)];
    if (column < 0 || parts == 0) return;
    kernels::TwistRows twist{frame, scale, {}, by_row, parts, block + static_cast<Eigen::Index>(column) * ld, false};
    if (xi != nullptr) std::copy(xi, xi + 6, twist.xi);
    twists.push_back(twist);
  };
  for (const Chain::Column& column : chain_.columns) {
    unsigned parts = 0;
    for (int k = 0; k < 6; ++k) parts |= (column.xi[k] != 0 ? 1U : 0U) << k;
    add(column.parameter, column.frame, column.xi.data(), nullptr, parts);
  }
  for (const EffectTwist& twist : twists_) add(twist.parameter, twist.frame, nullptr, twist.xi.data(), twist.parts);
  std::stable_sort(twists.begin(), twists.end(), [](const auto& a, const auto& b) { return a.frame < b.frame; });
  std::vector<bool> written(free_count_);
  for (kernels::TwistRows& twist : twists) {
    const auto column = static_cast<std::size_t>((twist.column - block) / ld);
    twist.adds = written[column];
    written[column] = true;
  }
  for (std::size_t k = 0; k < free_count_; ++k) {
    double* column = block + static_cast<Eigen::Index>(k) * ld;
    if (!written[k]) std::fill(column, column + ld, 0.0);
  }
  kernels::twist_columns(poses_.data(), frame_count(), stride_, twists.data(), static_cast<int>(twists.size()),
                         numbers);
}

}  // namespace fastcal
