// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/row_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "fastcal/ik/singular_walk.hpp"

namespace fastcal {
namespace {

constexpr int kEvaluations = 60;       // of one search; most that succeed need 10
constexpr int kFirstEvaluations = 20;  // of them before a walk along the postures of a singular arm
constexpr int kLastEvaluations = 400;  // of the search for the nearest pose
constexpr int kApproach = 12;          // steps of all rows together
constexpr double kHelped = 0.1;        // of the squared error that a good step leaves
constexpr double kFirstEquilibrium = 1e-4, kEquilibriumGain = 1e-3, kEquilibrium = 1e-13;
constexpr int kOthers = 24;            // further solutions of the chain to begin from
constexpr int kPersistence = 20;       // times the restarts, where the limits alone are in the way
constexpr double kRough = 1e-6;        // [m], [rad] how well the chain is solved where effects follow
constexpr double kSingular = 1e-6;     // least singular value, lengths over the reach
constexpr double kPerRoot = 10;        // it is at most so many times the root of the error at a singular posture
constexpr double kClose = 1e-5;        // [rad], of the reach: a solution is next to where an attempt got stuck
constexpr double kNotRotation = 1e-6;  // R R^T - 1

/// Of the chain alone, to what comes after it.
ChainSettings settings_of(const IkOptions& options, bool bare) {
  return {options.reach, bare ? options.tolerance_position : kRough, bare ? options.tolerance_rotation : kRough,
          options.random_seed, options.held};
}

/// Is there an effect of base or tool that is not nil?
bool moves_ends(const ErrorModel& model, const Eigen::VectorXd& theta) {
  Eigen::Index k = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    for (const Parameter& parameter : effect->parameters()) {
      if ((parameter.owner == "base" || parameter.owner == "tool") && theta[k] != 0) return true;
      ++k;
    }
  }
  return false;
}

}  // namespace

bool to_target(const double* numbers, Pose& target) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(numbers);
  if (!T.allFinite() || T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return false;
  target = {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  const Eigen::Matrix3d excess = target.R.transpose() * target.R - Eigen::Matrix3d::Identity();
  if (excess.cwiseAbs().maxCoeff() > kNotRotation || target.R.determinant() < 0) return false;
  target.R -= 0.5 * target.R * excess;  // rounded numbers: a Newton step to the nearest rotation
  return true;
}

RowSolver::RowSolver(const ErrorModel& model, const Eigen::VectorXd& theta, const IkOptions& options)
    : model_(model),
      theta_(theta),
      options_(options),
      chain_(model.robot().chain(theta.head(model.robot().nominal().size()))),
      limits_(options.limits),
      unlimited_(JointLimits::Constant(options.limits.rows(), 2, std::numeric_limits<double>::infinity())),
      bare_(model.effects().empty()),
      is_tree_(!chain_.is_serial() || chain_.has_loops()),
      moves_ends_(moves_ends(model, theta)),
      settings_(settings_of(options, bare_)),
      within_(chain_, limits_, settings_) {
  unlimited_.col(0) *= -1;
}

Pose RowSolver::seen_by_chain(const IkRow& row, ModelFrames& frames) const {
  if (!moves_ends_) return row.target;
  frames.choose(row.index);
  const std::vector<Pose>& T = frames.at(row.seed);
  const Pose tool = T[T.size() - 2].inverse() * T.back();
  return chain_.constants.front() * (T.front().inverse() * row.target * tool.inverse()) * chain_.constants.back();
}

void RowSolver::solve_chain(std::vector<IkRow>& rows, ModelFrames& frames, int restarts) const {
  if (is_tree_) {
    for (IkRow& row : rows) row.chain.q = row.seed;
    return;
  }
  std::vector<Eigen::Index> indices;
  std::vector<Pose> targets;
  std::vector<JointVector> seeds;
  for (IkRow& row : rows) {
    row.of_chain = seen_by_chain(row, frames);
    indices.push_back(row.index);
    targets.push_back(row.of_chain);
    seeds.push_back(row.seed);
  }
  std::vector<ChainSolution> found = within_.solve(indices, targets, seeds, restarts, kClose);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].chain = std::move(found[i]);
    unwind(rows[i].seed, limits_, rows[i].chain.q);
  }
}

void RowSolver::approach(std::vector<IkRow>& rows, const Samples& samples) const {
  std::vector<std::size_t> active;
  std::vector<Eigen::Index> kept;
  std::vector<JointVector> q;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].chain.reached) continue;
    active.push_back(i);
    kept.push_back(rows[i].index);
    q.push_back(rows[i].chain.q);
  }
  RowEvaluator evaluator(model_, theta_);
  const auto frame_count = static_cast<std::size_t>(chain_.frame_count());
  Samples part = samples;
  SettleOptions how{.needs = model_.needs(), .tolerance = kFirstEquilibrium};
  for (int step = 0; step < kApproach && !active.empty(); ++step) {
    part = part.pick(kept);
    for (std::size_t k = 0; k < active.size(); ++k) part.q.own().row(static_cast<Eigen::Index>(k)) = q[k].transpose();
    settle(model_, theta_, 1, part, how);
    const bool deflected = how.goes_on && !part.frames.empty();  // the first call begins with the undeflected arm
    how.goes_on = model_.at_equilibrium();
    how.tolerance = std::max(how.tolerance * kEquilibriumGain, kEquilibrium);
    std::vector<std::size_t> still;
    std::vector<JointVector> next;
    kept.clear();
    for (std::size_t k = 0; k < active.size(); ++k) {
      IkRow& row = rows[active[k]];
      const Goal goal = goal_of(row);
      const State state = part.row(static_cast<Eigen::Index>(k));
      const std::span<const Pose> frames = deflected ? std::span(state.frames, frame_count) : evaluator.frames(state);
      SearchPoint point = look(chain_, goal, q[k], frames);
      point.evaluations = step + 1;
      if (step > 0 && !(point.cost < kHelped * row.model.cost)) continue;
      row.model = std::move(point);
      if (row.model.reached && how.tolerance <= kEquilibrium) continue;
      still.push_back(active[k]);
      kept.push_back(static_cast<Eigen::Index>(k));
      next.push_back(step_from(row.model, goal, 0, held_at(row.seed, limits_)));
    }
    active = std::move(still);
    q = std::move(next);
  }
}

IkStatus RowSolver::finish(const IkRow& row, ModelFrames& frames, bool may_jump, SearchPoint& best) const {
  if (is_tree_) return finish_tree(row, frames, may_jump, best);
  if (bare_ && row.chain.reached &&
      row.chain.least_singular_value > near_singular(row.chain.position_error, row.chain.rotation_error)) {
    best.q = row.chain.q;
    best.position_error = row.chain.position_error;
    best.rotation_error = row.chain.rotation_error;
    best.evaluations = row.chain.evaluations;
    return IkStatus::kReached;
  }
  frames.choose(row.index);
  const FramesAt frames_at = [&](const JointVector& q) -> const std::vector<Pose>& { return frames.at(q); };
  const Goal goal = goal_of(row);
  const JointLimits box = held_at(row.seed, limits_);
  if (row.model.reached)
    best = row.model;
  else
    best = search(frames_at, goal, box, row.chain.q, kLastEvaluations);
  int evaluations = row.chain.evaluations + best.evaluations;
  const auto try_others = [&](const JointLimits& limits, int seeds, int restarts) {
    for (const JointVector& from : chain_solutions(row, limits, seeds, restarts, evaluations)) {
      SearchPoint found = search(frames_at, goal, held_at(row.seed, limits), from, kEvaluations);
      evaluations += found.evaluations;
      if (found.reached) return found;
    }
    return SearchPoint();
  };
  const auto take = [&](SearchPoint found) {
    if (found.reached) best = std::move(found);
  };
  if (!best.reached && !bare_ && may_jump && row.chain.reached) take(try_others(limits_, kOthers, 0));
  if (!best.reached && may_jump && !row.chain.reached && is_close(row.chain))
    take(try_others(limits_, kOthers, options_.restarts));
  IkStatus status = IkStatus::kReached;
  if (!best.reached) {
    if (bare_) unwind(row.seed, limits_, best.q);
    status = try_others(unlimited_, kOthers, 0).reached ? IkStatus::kLimit : IkStatus::kUnreachable;
    // Where only few of the postures lead to a solution within the limits, some luck may have been missing.
    if (status == IkStatus::kLimit && may_jump) take(try_others(limits_, 1, kPersistence * options_.restarts));
  }
  if (best.reached) status = is_singular(row, frames_at, best) ? IkStatus::kSingular : IkStatus::kReached;
  best.evaluations = evaluations;
  return status;
}

Goal RowSolver::goal_of(const IkRow& row) const {
  return {row.target, options_.reach, options_.tolerance_position, options_.tolerance_rotation};
}

bool RowSolver::is_held(Eigen::Index joint) const {
  return !options_.held.empty() && options_.held[static_cast<std::size_t>(joint)];
}

JointLimits RowSolver::held_at(const JointVector& seed, const JointLimits& limits) const {
  JointLimits out = limits;
  for (Eigen::Index i = 0; i < seed.size(); ++i) {
    if (is_held(i)) out.row(i).setConstant(std::clamp(seed[i], limits_(i, 0), limits_(i, 1)));
  }
  return out;
}

SearchPoint RowSolver::search(const FramesAt& frames_at, const Goal& goal, const JointLimits& limits,
                              const JointVector& from, int max_evaluations) const {
  SearchPoint found = search_pose(chain_, frames_at, goal, limits, from, kFirstEvaluations);
  if (found.reached) return found;
  int evaluations = found.evaluations;
  const auto take = [&](SearchPoint point) {
    evaluations += point.evaluations;
    if (point.reached) found = std::move(point);
  };
  const bool free = (limits.col(0).array() < limits.col(1).array()).count() >= 6;
  if (free && found.cost <= kClose * kClose &&
      least_singular_value(chain_, found.J, options_.reach) <
          near_singular(found.position_error, found.rotation_error)) {
    take(walk_singular(chain_, frames_at, goal, limits, found.q));
    // A limit that stood in the way may be a whole turn from where the way leads.
    const JointVector middle = limits.rowwise().mean();
    if (!found.reached && middle.allFinite()) {
      SearchPoint beyond = walk_singular(chain_, frames_at, goal, held_at(from, unlimited_), found.q);
      unwind(middle, limits, beyond.q);
      evaluations += beyond.evaluations;
      if (beyond.reached) take(search_pose(chain_, frames_at, goal, limits, beyond.q, kFirstEvaluations));
    }
  }
  if (!found.reached) {
    found = search_pose(chain_, frames_at, goal, limits, found.q, max_evaluations - kFirstEvaluations);
    evaluations += found.evaluations;
  }
  found.evaluations = evaluations;
  return found;
}

bool RowSolver::is_close(const ChainSolution& found) const {
  return std::hypot(found.position_error / options_.reach, found.rotation_error) <= kClose;
}

double RowSolver::near_singular(double position_error, double rotation_error) const {
  return kPerRoot * std::sqrt(std::max(position_error / options_.reach, rotation_error));
}

bool RowSolver::is_singular(const IkRow& row, const FramesAt& frames_at, const SearchPoint& point) const {
  const double least = least_singular_value(chain_, point.J, options_.reach);
  if (least < kSingular) return true;
  if (least >= near_singular(point.position_error, point.rotation_error)) return false;
  constexpr double kFinest =
      (kSingular / kPerRoot) * (kSingular / kPerRoot);  // [rad], of the reach: tells the two apart
  Goal goal = goal_of(row);
  goal.tolerance_position = kFinest * options_.reach;
  goal.tolerance_rotation = kFinest;
  const SearchPoint end = search_pose(chain_, frames_at, goal, held_at(row.seed, limits_), point.q, kLastEvaluations);
  return least_singular_value(chain_, end.J, options_.reach) < kSingular;
}

std::vector<JointVector> RowSolver::chain_solutions(const IkRow& row, const JointLimits& limits, int count,
                                                    int restarts, int& evaluations) const {
  const ChainSolver solver(chain_, limits, settings_);
  const std::vector<Eigen::Index> indices(static_cast<std::size_t>(count), row.index);
  const std::vector<Pose> targets(static_cast<std::size_t>(count), row.of_chain);
  std::vector<JointVector> seeds{row.chain.q};
  for (int k = 1; k < count; ++k) {
    seeds.push_back(within_.restart(row.index, k));
    for (Eigen::Index i = 0; i < row.seed.size(); ++i) {
      if (is_held(i)) seeds.back()[i] = row.seed[i];
    }
  }
  std::vector<JointVector> out;
  for (ChainSolution& found : solver.solve(indices, targets, seeds, restarts, kClose)) {
    evaluations += found.evaluations;
    if (!found.reached && !is_close(found)) continue;
    unwind(row.seed, limits, found.q);
    out.push_back(std::move(found.q));
  }
  return out;
}

void RowSolver::unwind(const JointVector& seed, const JointLimits& limits, JointVector& q) const {
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    if (chain_.joint_types[static_cast<std::size_t>(i)] != JointType::kRevolute) continue;
    const double turns = std::round((q[i] - seed[i]) / (2 * M_PI));
    const double to = q[i] - turns * 2 * M_PI;
    if (turns != 0 && to >= limits(i, 0) && to <= limits(i, 1)) q[i] = to;
  }
}

}  // namespace fastcal
