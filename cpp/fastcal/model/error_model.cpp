// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/error_model.hpp"

#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/math/pivoted_lu.hpp"
#include "fastcal/math/se3.hpp"

namespace fastcal {

ErrorModel::ErrorModel(RobotModel robot, std::vector<std::shared_ptr<const Effect>> effects,
                       const Eigen::VectorXd& effect_values)
    : robot_(std::move(robot)), effects_(std::move(effects)), parameters_(robot_.parameters()) {
  for (const auto& effect : effects_)
    parameters_.insert(parameters_.end(), effect->parameters().begin(), effect->parameters().end());
  const Eigen::Index own = robot_.nominal().size();
  for (auto i = static_cast<std::size_t>(own); i < parameters_.size(); ++i) parameters_[i].of_effect = true;
  const Eigen::Index added = parameter_count() - own;
  FASTCAL_CHECK(effect_values.size() == 0 || effect_values.size() == added)
      << "the effects have " << added << " parameters, got " << effect_values.size() << " values";
  for (const auto& effect : effects_) needs_ |= effect->needs();
  start_ = Eigen::VectorXd::Zero(own + added);
  start_.head(own) = robot_.nominal();
  if (effect_values.size() > 0) start_.tail(added) = effect_values;
}

ErrorModel ErrorModel::with_robot(RobotModel robot) const {
  return ErrorModel(std::move(robot), effects_, start_.tail(start_.size() - robot_.nominal().size()))
      .with_equilibrium(at_equilibrium_);
}

ErrorModel ErrorModel::with_equilibrium(bool at_equilibrium) const {
  ErrorModel out = *this;
  out.at_equilibrium_ = at_equilibrium;
  return out;
}

std::optional<JointSprings> ErrorModel::springs(const Eigen::Ref<const Eigen::VectorXd>& theta) const {
  const int n = robot_.joint_count();
  if ((needs_ & kLoads) == 0 || !at_equilibrium_ || robot_.description().compensator || !robot_.tree().is_serial() ||
      !robot_.description().passive.empty())
    return {};
  JointSprings out{Eigen::VectorXd::Zero(n), Weights(n)};
  Eigen::Index first = robot_.nominal().size();
  for (const auto& effect : effects_) {
    if (effect->is_weight()) {
      effect->add_weights(theta.data() + first, out.weights);
    } else if (effect->is_spring()) {
      for (int j = 0; j < n; ++j) out.compliance[j] += effect->joint_compliance({}, j, theta.data() + first);
    } else if (effect->needs() != kNothing) {
      return {};
    }
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
  return out;
}

namespace {

const Eigen::Ref<const Eigen::VectorXd>& checked(const ErrorModel& model,
                                                 const Eigen::Ref<const Eigen::VectorXd>& theta) {
  FASTCAL_CHECK(theta.size() == model.parameter_count())
      << "the model has " << model.parameter_count() << " parameters, got " << theta.size();
  return theta;
}

}  // namespace

RowEvaluator::RowEvaluator(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta)
    : model_(model),
      theta_(checked(model, theta)),
      chain_(model.robot().chain(theta.head(model.robot().nominal().size()))),
      xi_(Twists::Zero(6, chain_.twist_count())),
      steady_(xi_) {
  if (chain_.has_loops()) assembler_.emplace(chain_);
}

void RowEvaluator::find_frames(const State& state, const Twists* xi) {
  if (!assembler_) return forward(chain_, state.q, xi, frames_);
  q_.assign(state.q, state.q + chain_.joint_count());
  assembler_->close(q_.data(), xi);
  frames_ = assembler_->frames();
}

void RowEvaluator::deflect(const State& state, bool with_needs, Twists& xi) const {
  Eigen::Index first = model_.robot().nominal().size();
  for (const auto& effect : model_.effects()) {
    if ((effect->needs() != kNothing) == with_needs) effect->deflect(state, theta_.data() + first, xi, nullptr);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
}

void RowEvaluator::evaluate(const State& state, bool again) {
  if (model_.effects().empty()) return find_frames(state, nullptr);
  if (!again) {
    steady_.setZero();
    deflect(state, false, steady_);
  }
  xi_ = steady_;
  deflect(state, true, xi_);
  find_frames(state, &xi_);
}

const std::vector<Pose>& RowEvaluator::frames(const State& state, bool deflected, bool again) {
  if (deflected)
    evaluate(state, again);
  else
    find_frames(state, nullptr);
  return frames_;
}

const std::vector<Pose>& RowEvaluator::columns(const State& state) {
  xi_.setZero();
  columns_.clear();
  int first = static_cast<int>(model_.robot().nominal().size());
  for (const auto& effect : model_.effects()) {
    const std::size_t before = columns_.size();
    effect->deflect(state, theta_.data() + first, xi_, &columns_);
    for (std::size_t i = before; i < columns_.size(); ++i) columns_[i].parameter += first;
    first += static_cast<int>(effect->parameters().size());
  }
  find_frames(state, model_.effects().empty() ? nullptr : &xi_);
  if (assembler_) follow_loops();
  return frames_;
}

const Pose& RowEvaluator::jacobian(const State& state, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) {
  columns(state);
  const int tool = model_.robot().view().target;
  motion(tool, J);
  return frames_[static_cast<std::size_t>(tool)];
}

Pose RowEvaluator::jacobian(const State& state, const View& view,
                            Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) {
  columns(state);
  Pose out = seen(view, frames_);
  J.setZero();
  if (view.target != kWorldFrame) motion(view.target, J);
  if (view.sensor == kWorldFrame) return out;
  // d p = R_s^T (v_t - v_s - w_s x (p_t - p_s)), d R about R_s^T (w_t - w_s)
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_sensor(6, J.cols());
  motion(view.sensor, by_sensor);
  const Pose& sensor = frames_[static_cast<std::size_t>(view.sensor)];
  const Eigen::Vector3d line = sensor.R * out.p;
  J -= by_sensor;
  J.topRows<3>() += skew(line) * by_sensor.bottomRows<3>();
  J.topRows<3>() = (sensor.R.transpose() * J.topRows<3>()).eval();
  J.bottomRows<3>() = (sensor.R.transpose() * J.bottomRows<3>()).eval();
  return out;
}

void RowEvaluator::follow_loops() {
  const std::vector<LoopRow>& rows = assembler_->rows();
  const auto m = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd by_parameter = Eigen::MatrixXd::Zero(m, model_.parameter_count());
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model_.parameter_count());
  for (Eigen::Index r = 0; r < m; ++r) {
    const LoopRow& row = rows[static_cast<std::size_t>(r)];
    const auto add = [&](int frame, const Vector6d& slope) {
      if (frame == kWorldFrame || slope.isZero(0)) return;
      open_motion(frame, J);
      by_parameter.row(r) += slope.transpose() * J;
    };
    add(row.frames.target, row.by_target);
    add(row.frames.sensor, row.by_sensor);
    for (const auto& [parameter, by] : row.by_parameter) by_parameter(r, parameter) += by;
    for (const auto& column : columns_) {
      if (column.frame == row.rod) by_parameter(r, column.parameter) -= column.xi[kAlongRod];
    }
    for (const auto& [joint, share] : row.by_turn) {
      const int part = chain_.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute ? 5 : 2;
      for (const auto& column : columns_) {
        if (column.frame == chain_.tree->frame_of_joint(joint))
          by_parameter(r, column.parameter) += share * column.xi[part];
      }
    }
  }
  passive_ = -solve(Eigen::FullPivLU<Eigen::MatrixXd>(assembler_->by_passive()), by_parameter);
}

void RowEvaluator::motion(int of, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) const {
  open_motion(of, J);
  for (std::size_t p = 0; p < chain_.passive.size(); ++p) {
    const int frame = chain_.tree->frame_of_joint(chain_.passive[p]);
    if (!chain_.tree->carries(frame, of)) continue;
    const Vector6d along = joint_axis(chain_, chain_.passive[p], model_.effects().empty() ? nullptr : &xi_);
    J += tool_motion(frames_[static_cast<std::size_t>(frame)], frames_[static_cast<std::size_t>(of)].p, along) *
         passive_.row(static_cast<Eigen::Index>(p));
  }
}

void RowEvaluator::open_motion(int of, Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J) const {
  const Eigen::Vector3d& p = frames_[of].p;
  J.setZero();
  const Pose world;
  const FrameTree& tree = *chain_.tree;
  const int* first_moved = chain_.first_moved.data();
  for (const Chain::Column& column : chain_.columns) {
    if (!tree.carries(*first_moved++, of)) continue;
    const Pose& frame = column.frame == kWorldFrame ? world : frames_[column.frame];
    J.col(column.parameter) += tool_motion(frame, p, column.xi);
  }
  for (const Chain::Column& column : columns_) {
    if (!tree.carries(column.frame, of)) continue;
    // exp(xi + d) = exp(xi) exp(J_r d): exact at any size of the twist; J_r is 1 where both turn about the same axis.
    const auto twist = xi_.col(column.frame);
    const bool same = twist.isZero(0) || (is_turn_about_z(twist) && is_turn_about_z(column.xi));
    const Pose& frame = frames_[column.frame];
    J.col(column.parameter) += tool_motion(frame, p, same ? column.xi : (right_jacobian_se3(twist) * column.xi).eval());
  }
}

}  // namespace fastcal
