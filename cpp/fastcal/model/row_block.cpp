// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/row_block.hpp"

#include <algorithm>
#include <initializer_list>

#include "fastcal/kernels/streams.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/robot/statics.hpp"

namespace fastcal {
namespace {

constexpr int kNumbersAtOnce = 32;        // that the kernel takes
constexpr std::size_t kManyColumns = 24;  // from there on their sum, row by row, is quicker than a table of them

void write(const Pose& pose, double* out, Eigen::Index step) {
  for (int k = 0; k < 9; ++k) out[k * step] = pose.R(k % 3, k / 3);
  for (int k = 0; k < 3; ++k) out[(9 + k) * step] = pose.p[k];
}

kernels::Turn turn_of(const Eigen::Matrix3d& R) {
  const bool keeps_x = R(0, 0) == 1 && R(1, 0) == 0 && R(2, 0) == 0;
  const bool keeps_z = R(2, 2) == 1 && R(0, 2) == 0 && R(1, 2) == 0;
  if (keeps_x && keeps_z) return kernels::Turn::kNone;
  return keeps_x ? kernels::Turn::kAboutX : keeps_z ? kernels::Turn::kAboutZ : kernels::Turn::kAny;
}

}  // namespace

RowBlock::RowBlock(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta,
                   const std::vector<int>& free, const Eigen::VectorXd& scale, Frames kept, const JointSprings* springs)
    : theta_(theta),
      kept_(kept),
      chain_(model.robot().chain(theta.head(model.robot().nominal().size()))),
      wanted_(static_cast<std::size_t>(model.parameter_count()), {-1, 0.0}),
      free_count_(free.size()),
      xi_(Twists::Zero(6, chain_.twist_count())),
      moved_(static_cast<std::size_t>(chain_.twist_count())),
      tilted_(moved_),
      frame_xi_(moved_.size()),
      angle_(static_cast<std::size_t>(frame_count())),
      motion_(angle_.size()),
      frames_(angle_.size()),
      steps_(angle_.size() * kernels::kMostSteps) {
  for (std::size_t k = 0; k < free.size(); ++k) {
    if (free[k] < model.parameter_count())
      wanted_[static_cast<std::size_t>(free[k])] = {static_cast<int>(k), scale[static_cast<Eigen::Index>(k)]};
  }
  int first = static_cast<int>(model.robot().nominal().size());
  for (const auto& effect : model.effects()) {
    const bool apart = springs != nullptr && (effect->is_spring() || effect->is_weight());
    if (const auto* linear = dynamic_cast<const LinearEffect*>(effect.get()); linear != nullptr && !apart)
      linear_.emplace_back(linear, first);
    else if (!apart)
      others_.emplace_back(effect.get(), first);
    first += static_cast<int>(effect->parameters().size());
  }
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const Pose& C = chain_.constants[f];
    write(C, frames_[f].constant, 1);
    frames_[f].constant_turn = turn_of(C.R);
    frames_[f].branches_off = chain_.tree->parent(static_cast<int>(f)) != static_cast<int>(f) - 1;
  }
  if (chain_.has_loops()) {
    loops_.emplace(chain_);
    kept_ = Frames::kAll;
  }
  if (springs != nullptr) springs_.emplace(model.robot().description(), chain_, *springs, frames_.data());
  set_geometry(kWorldFrame);
}

void RowBlock::forward(const Samples& samples, Eigen::Index begin, Eigen::Index end, TwistMemory* memory) {
  rows_ = static_cast<int>(end - begin);
  stride_ = (rows_ + kernels::kGroup - 1) / kernels::kGroup * kernels::kGroup;
  std::fill(moved_.begin(), moved_.end(), false);
  std::fill(tilted_.begin(), tilted_.end(), false);
  const bool sums = free_count_ == 0 && memory == nullptr;
  if (!linear_.empty()) evaluate_linear_effects(samples, begin, memory, sums);
  if (!others_.empty() || sums) ask_others(samples, begin, sums);
  read_joints(samples, begin);
  if (loops_) close_loops();
  for (int f = 0; f < frame_count(); ++f) {
    const auto k = static_cast<std::size_t>(f);
    kernels::FrameRows& frame = frames_[k];
    frame.slide = frame.turn = frame.motion = nullptr;
    const int number = chain_.tree->joint(f);
    const bool joint = number >= 0;
    if (!joint && !moved_[k]) continue;
    const double* xi = frame_xi_[k].data();
    const bool turned = moved_[k] && !tilted_[k];
    double* angle = angle_[k].resize(4 * stride_);
    double* shift = angle + stride_;
    const bool revolute = joint && chain_.joint_types[static_cast<std::size_t>(number)] == JointType::kRevolute;
    if (joint) std::copy_n(joints_.data() + number * stride_, stride_, revolute ? angle : shift);
    if (turned && !revolute) std::fill(angle, angle + stride_, 0.0);
    for (int i = 0; turned && i < rows_; ++i) angle[i] += xi[5 * stride_ + i];
    if (revolute || turned) frame.turn = angle;
    if (joint && !revolute) frame.slide = shift;
    if (tilted_[k]) {
      general_motion(f);
      frame.motion = motion_[k].data();
    }
  }
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    if (frames_[k].turn == nullptr) continue;
    double* sine_cosine = angle_[k].data() + 2 * stride_;
    kernels::sines_and_cosines(frames_[k].turn, stride_, sine_cosine);
    frames_[k].sine_cosine = sine_cosine;
  }
  if (springs_) settled_ = springs_->settle(samples, begin, rows_, stride_, moved_, tilted_, angle_);
  if (kept_ == Frames::kNone) return;
  find_steps(kept_count());
  double* poses = poses_.resize(static_cast<Eigen::Index>(kept_count()) * kernels::kPoseNumbers * stride_);
  find_poses(0, stride_, poses);
}

void RowBlock::find_steps(int kept) {
  step_count_ = 0;
  runs_.clear();
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    if (!chain_.is_serial() && (k == 0 || frames_[k].branches_off))
      runs_.push_back({chain_.tree->parent(static_cast<int>(k)), static_cast<int>(k), step_count_, step_count_});
    step_count_ += kernels::steps_of(frames_[k], steps_.data() + step_count_);
    if (frames_.size() - k > static_cast<std::size_t>(kept)) --step_count_;  // the end of a frame that is not kept
    if (!runs_.empty()) runs_.back().last_step = step_count_;
  }
}

void RowBlock::find_steps_to(int frame) {
  step_count_ = 0;
  for (int f = 0; f < frame_count() && frame != kWorldFrame; ++f) {
    if (!chain_.tree->carries(f, frame)) continue;
    step_count_ += kernels::steps_of(frames_[static_cast<std::size_t>(f)], steps_.data() + step_count_) - 1;
  }
}

void RowBlock::find_poses(int first, int last, double* poses) const {
  if (runs_.empty()) {
    const int count = kept_ == Frames::kTool ? 1 : frame_count();
    kernels::forward_rows(steps_.data(), step_count_, count, stride_, first, last, poses);
  } else {
    kernels::forward_runs(steps_.data(), runs_.data(), static_cast<int>(runs_.size()), frame_count(), stride_, first,
                          last, poses);
  }
}

void RowBlock::write_seen(const View& view, double* out) {
  find_steps_to(view.target);
  kernels::forward_matrices(steps_.data(), step_count_, stride_, rows_, out);
  if (view.sensor == kWorldFrame) return;
  RowMatrixXd sensors(rows_, 16);
  find_steps_to(view.sensor);
  kernels::forward_matrices(steps_.data(), step_count_, stride_, rows_, sensors.data());
  using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  for (int i = 0; i < rows_; ++i) {
    const Eigen::Map<const Matrix> T_world_sensor(sensors.row(i).data());
    Eigen::Map<Matrix> target(out + 16 * i);
    const Eigen::Matrix3d R = T_world_sensor.topLeftCorner<3, 3>().transpose();
    target.topRightCorner<3, 1>() -= T_world_sensor.topRightCorner<3, 1>();
    target.topRows<3>() = (R * target.topRows<3>()).eval();
  }
}

void RowBlock::find_steps_of_twists(int of) {
  if (!chain_.is_serial()) return find_steps(frame_count());
  runs_.clear();
  step_count_ = 0;
  std::vector<bool> seen(frames_.size());
  seen[static_cast<std::size_t>(of)] = true;
  for (const kernels::FrameTwists& twists : gathered_.frames()) {
    if (twists.frame >= 0) seen[static_cast<std::size_t>(twists.frame)] = true;
  }
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    step_count_ += kernels::steps_of(frames_[k], steps_.data() + step_count_);
    if (!seen[k]) steps_[static_cast<std::size_t>(step_count_ - 1)].kind = kernels::ChainStep::Kind::kUnseen;
  }
}

void RowBlock::read_joints(const Samples& samples, Eigen::Index begin) {
  const int n = chain_.joint_count();
  double* joints = joints_.resize(static_cast<Eigen::Index>(n) * stride_);
  FASTCAL_CHECK(kernels::read_rows(samples.q.row(begin), rows_, n, stride_, joints)) << "q must be finite";
}

double* RowBlock::move(int frame) {
  const auto k = static_cast<std::size_t>(frame);
  double* xi = frame_xi_[k].resize(6 * stride_);
  if (!moved_[k]) std::fill(xi + 5 * stride_, xi + 6 * stride_, 0.0);
  moved_[k] = true;
  return xi;
}

double* RowBlock::tilt(int frame) {
  const auto k = static_cast<std::size_t>(frame);
  double* xi = move(frame);
  if (!tilted_[k]) std::fill(xi, xi + 5 * stride_, 0.0);
  tilted_[k] = true;
  return xi;
}

void RowBlock::evaluate_linear_effects(const Samples& samples, Eigen::Index begin, TwistMemory* memory, bool sums) {
  TwistMemory::Chunk* known = memory == nullptr ? nullptr : &memory->chunk(begin);
  table_ = known != nullptr && known->known ? &known->table : &own_table_;
  if (table_ == &own_table_) {
    own_table_.clear(stride_);
    by_row_.clear();
    for (const auto& [effect, first] : linear_) {
      if (sums && effect->parameters().size() >= kManyColumns) continue;
      own_table_.count_from(first);
      if (!effect->add_basis(samples, begin, rows_, own_table_)) by_row_.emplace_back(effect, first);
    }
    own_table_.count_from(0);
    for (int i = 0; !by_row_.empty() && i < rows_; ++i) {
      const State state = samples.row(begin + i);
      columns_.clear();
      for (const auto& [effect, first] : by_row_) {
        const std::size_t before = columns_.size();
        effect->basis(state, columns_);
        for (std::size_t c = before; c < columns_.size(); ++c) columns_[c].parameter += first;
      }
      own_table_.add(columns_, i);
    }
    if (known != nullptr && TwistMemory::has_room(own_table_.bytes(), samples.count())) {
      known->table = own_table_;
      known->known = true;
    }
  }
  for (const TwistTable::Entry& entry : table_->entries()) {
    const double theta = theta_[entry.parameter];
    if (theta == 0) continue;
    for (int k = 0; k < 6; ++k) {
      const double* part = entry.part(k, stride_);
      if (part == nullptr) continue;
      double* xi = (k == 5 ? move(entry.frame) : tilt(entry.frame)) + k * stride_;
      for (int i = 0; i < stride_; ++i) xi[i] += theta * part[i];
    }
  }
}

void RowBlock::ask_others(const Samples& samples, Eigen::Index begin, bool sums) {
  other_table_.clear(stride_);
  std::vector<std::pair<const Effect*, int>> asked = others_;
  for (const auto& [effect, first] : linear_) {
    if (sums && effect->parameters().size() >= kManyColumns) asked.emplace_back(effect, first);
  }
  if (asked.empty()) return;
  for (int i = 0; i < rows_; ++i) {
    const State state = samples.row(begin + i);
    xi_.setZero();
    columns_.clear();
    for (const auto& [effect, first] : asked) {
      const std::size_t before = columns_.size();
      effect->deflect(state, theta_.data() + first, xi_, sums ? nullptr : &columns_);
      for (std::size_t c = before; c < columns_.size(); ++c) columns_[c].parameter += first;
    }
    other_table_.add(columns_, i);
    for (int f = 0; f < chain_.twist_count(); ++f) {
      const auto xi = xi_.col(f);
      if (xi.cwiseAbs().sum() == 0) continue;
      const bool turns = is_turn_about_z(xi);
      double* to = turns ? move(f) : tilt(f);
      for (int part = turns ? 5 : 0; part < 6; ++part) to[part * stride_ + i] += xi[part];
    }
  }
}

void RowBlock::general_motion(int frame) {
  const auto k = static_cast<std::size_t>(frame);
  double* motion = motion_[k].resize(kernels::kPoseNumbers * stride_);
  const Pose none;
  for (int i = 0; i < stride_; ++i) write(i < rows_ ? exp_se3(frame_twist(frame, i)) : none, motion + i, stride_);
}

void RowBlock::rotate_twists(int frame, std::vector<kernels::TwistRows*>& twists) {
  std::vector<double*> to;
  for (kernels::TwistRows* twist : twists) {
    turned_.emplace_back();
    double* parts = turned_.back().resize(6 * stride_);
    std::fill(parts, parts + 6 * stride_, 0.0);
    for (int u = 0; u < twist->term_count; ++u) {
      const kernels::TwistTerm& term = twist->terms[u];
      std::copy_n(term.rows, stride_, parts + (3 * term.turns + term.axis) * stride_);
    }
    twist->term_count = 0;
    for (int k = 0; k < 6; ++k) add_term(k, 0, parts + k * stride_, *twist);
    to.push_back(parts);
  }
  for (int i = 0; i < rows_; ++i) {
    const Vector6d here = frame_twist(frame, i);
    if (here.isZero(0)) continue;
    const Matrix6d J_r = right_jacobian_se3(here);
    for (double* parts : to) {
      Eigen::Map<Vector6d, 0, Eigen::InnerStride<>> xi(parts + i, Eigen::InnerStride<>(stride_));
      xi = (J_r * xi).eval();
    }
  }
}

Pose RowBlock::frame(int frame, int i) const {
  const double* parts = pose_parts(frame, i);
  Pose out;
  for (int k = 0; k < 9; ++k) out.R(k % 3, k / 3) = parts[k * kernels::kGroup];
  for (int k = 0; k < 3; ++k) out.p[k] = parts[(9 + k) * kernels::kGroup];
  return out;
}

kernels::TwistRows* RowBlock::add_twist(int parameter, int frame, int first_moved,
                                        std::vector<kernels::TwistRows>& to) const {
  const auto& [column, scale] = wanted_[static_cast<std::size_t>(parameter)];
  if (column < 0) return nullptr;
  return &to.emplace_back(
      kernels::TwistRows{frame, first_moved, column, false, scale, 0, {}, chain_.tree->end(first_moved)});
}

void RowBlock::set_geometry(int of) {
  geometry_.clear();
  geometry_of_ = of;
  gathered_alike_ = false;
  for (std::size_t c = 0; c < chain_.columns.size(); ++c) {
    const Chain::Column& column = chain_.columns[c];
    kernels::TwistRows* twist = add_twist(column.parameter, column.frame, chain_.first_moved[c], geometry_);
    for (int k = 0; twist != nullptr && k < 6; ++k) {
      if (column.xi[k] != 0) add_term(k, column.xi[k], nullptr, *twist);
    }
  }
  if (of != kWorldFrame) keep_twists_of(of, geometry_);
  unmoved_.assign(static_cast<std::size_t>(column_count()), true);
  put_in_order(geometry_, unmoved_);
}

void RowBlock::find_twists(int of) {
  const std::initializer_list<const TwistTable*> tables{table_, &other_table_};
  moving_.clear();
  for (const TwistTable* table : tables) {
    for (const TwistTable::Entry& entry : table->entries()) {
      if (entry.values.empty() || entry.frame >= frame_count()) continue;
      kernels::TwistRows* twist = add_twist(entry.parameter, entry.frame, entry.frame, moving_);
      for (int k = 0; twist != nullptr && k < 6; ++k) {
        if (const double* part = entry.part(k, stride_)) add_term(k, 0, part, *twist);
      }
    }
  }
  turned_.clear();
  for (int f = 0; f < frame_count(); ++f) {
    const auto k = static_cast<std::size_t>(f);
    if (!moved_[k]) continue;
    std::vector<kernels::TwistRows*> here;
    for (kernels::TwistRows& twist : moving_) {
      // Where both turn about z, the right Jacobian is 1.
      if (twist.frame == f && (tilted_[k] || !only_turns_about_z(twist))) here.push_back(&twist);
    }
    if (here.empty()) continue;
    tilt(f);
    rotate_twists(f, here);
  }
  if (loops_) loops_->add_twists(static_cast<int>(free_count_), moving_);
  if (of != kWorldFrame) keep_twists_of(of, moving_);
  unmoved_here_ = unmoved_;
  put_in_order(moving_, unmoved_here_);
  const bool alike = moving_.empty() && std::none_of(frames_.begin(), frames_.end(),
                                                     [](const auto& frame) { return frame.motion != nullptr; });
  if (!alike || !gathered_alike_) gathered_.gather(geometry_, moving_, frames_, unmoved_.size());
  gathered_alike_ = alike;
}

void RowBlock::clear_unmoved(double* block, Eigen::Index ld) const {
  for (std::size_t k = 0; k < unmoved_here_.size(); ++k) {
    if (unmoved_here_[k]) std::fill_n(block + static_cast<Eigen::Index>(k) * ld, ld, 0.0);
  }
}

void RowBlock::open_jacobian(const kernels::NumberRows& numbers, double* block, int ld) {
  if (geometry_of_ != kWorldFrame) set_geometry(kWorldFrame);
  find_twists(kWorldFrame);
  clear_unmoved(block, ld);
  const auto write = [&](const kernels::NumberRows& some, double* columns) {
    kernels::twist_columns(poses_.data(), frame_count(), stride_, gathered_.frames().data(), gathered_.count(), some,
                           columns, ld);
  };
  const int tool = static_cast<int>(numbers.tool);
  if (tool + numbers.others <= kNumbersAtOnce) {
    write(numbers, block);
    return;
  }
  // Of very many numbers, as of a picture, some at a time.
  std::vector<kernels::Sight> sights;
  for (int s = 0, first = 0, end = 0; first < tool + numbers.others; first = end) {
    end = std::min(first + kNumbersAtOnce, tool + numbers.others);
    sights.clear();
    for (; s < numbers.sight_count && numbers.sights[s].number < end; ++s) {
      sights.push_back(numbers.sights[s]);
      sights.back().number -= first;
    }
    const bool whole = first == 0;
    write({whole ? numbers.tool : kernels::ToolNumbers::kNone, end - first - (whole ? tool : 0),
           numbers.factor + static_cast<Eigen::Index>(first) * stride_, sights.data(), static_cast<int>(sights.size())},
          block + static_cast<Eigen::Index>(first) * stride_);
  }
}

void RowBlock::keep_twists_of(int frame, std::vector<kernels::TwistRows>& twists) const {
  std::erase_if(twists, [frame](const auto& twist) { return frame < twist.first_moved || frame >= twist.end_moved; });
}

void RowBlock::write_jacobian(int of, kernels::ToolNumbers numbers, bool past_caches, double* out) {
  if (loops_) return write_closed_jacobian(of, static_cast<int>(numbers), out);
  constexpr int kGroup = kernels::kGroup;
  const int columns = static_cast<int>(free_count_);
  const bool is_end = chain_.is_serial() && of == frame_count() - 1;  // which every twist moves
  const int only = is_end ? kWorldFrame : of;
  if (geometry_of_ != only) set_geometry(only);
  find_twists(only);
  find_steps_of_twists(of);
  // Group by group, so that its frames, columns and matrices stay in the first cache.
  const Eigen::Index size = static_cast<Eigen::Index>(columns) * static_cast<int>(numbers) * kGroup;
  const Eigen::Index poses_size = static_cast<Eigen::Index>(frame_count()) * kernels::kPoseNumbers * kGroup;
  double* poses = group_.resize(2 * size + poses_size + kernels::kLine);
  double* block = poses + poses_size;
  std::fill_n(block, size, 0.0);
  kernels::LineStream stream(past_caches ? block + size : nullptr, out);
  for (int row = 0; row < rows_; row += kGroup) {
    find_poses(row, row + kGroup, poses);
    kernels::tool_jacobians(poses, of + 1, gathered_.frames().data(), gathered_.count(), numbers, columns, row,
                            std::min(kGroup, rows_ - row), block, stream);
  }
  stream.finish();
}

}  // namespace fastcal
