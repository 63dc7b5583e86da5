// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/inverse_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "fastcal/ik/chain_solver.hpp"
#include "fastcal/ik/pose_search.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

constexpr int kEvaluations = 60;       // of one search; most that succeed need 10
constexpr int kLastEvaluations = 400;  // of the search for the nearest pose
constexpr int kApproach = 12;          // steps of all rows together
constexpr double kHelped = 0.1;        // of the squared error that a good step leaves
constexpr double kFirstEquilibrium = 1e-4, kEquilibriumGain = 1e-3, kEquilibrium = 1e-13;
constexpr int kOthers = 24;            // further solutions of the chain to begin from
constexpr int kPersistence = 20;       // times the restarts, where the limits alone are in the way
constexpr double kRough = 1e-6;        // [m], [rad] how well the chain is solved where effects follow
constexpr double kSingular = 1e-6;     // least singular value, lengths over the reach
constexpr double kFinest = 1e-15;      // [rad], of the reach
constexpr double kNotRotation = 1e-6;  // R R^T - 1

/// Frames of the whole model at joint positions of one row after another; one a thread.
class ModelFrames {
 public:
  ModelFrames(const ErrorModel& model, const Eigen::VectorXd& theta, const Samples& samples)
      : model_(model), theta_(theta), samples_(samples), evaluator_(model, theta) {}

  void choose(Eigen::Index row) {
    if (!model_.effects().empty()) sample_ = samples_.slice(row, row + 1);
  }

  const std::vector<Pose>& at(const JointVector& q) {
    if (model_.effects().empty()) {
      State state;
      state.q = q.data();
      return evaluator_.frames(state);
    }
    sample_.q.row(0) = q.transpose();
    settle(model_, theta_, 1, sample_);
    return evaluator_.frames(sample_.row(0));
  }

 private:
  const ErrorModel& model_;
  const Eigen::VectorXd& theta_;
  const Samples& samples_;
  Samples sample_;
  RowEvaluator evaluator_;
};

/// What is known of a row once its chain is solved.
struct Row {
  Eigen::Index index = 0;
  Pose target;
  JointVector seed;
  ChainSolution chain;
  SearchPoint model;  ///< where the model stands, as far as approach() brought it
};

class Solver {
 public:
  Solver(const ErrorModel& model, const Eigen::VectorXd& theta, const IkOptions& options)
      : model_(model),
        theta_(theta),
        options_(options),
        chain_(model.robot().chain(theta.head(model.robot().nominal().size()))),
        limits_(options.limits),
        unlimited_(JointLimits::Constant(options.limits.rows(), 2, std::numeric_limits<double>::infinity())),
        bare_(model.effects().empty()),
        settings_{options.reach, options.tolerance_position, options.tolerance_rotation, options.random_seed,
                  options.held} {
    unlimited_.col(0) *= -1;
    if (!bare_) settings_.tolerance_position = settings_.tolerance_rotation = kRough;
  }

  void solve_chain(std::vector<Row>& rows, int restarts) const {
    std::vector<Eigen::Index> indices;
    std::vector<Pose> targets;
    std::vector<JointVector> seeds;
    for (const Row& row : rows) {
      indices.push_back(row.index);
      targets.push_back(row.target);
      seeds.push_back(row.seed);
    }
    std::vector<ChainSolution> found = ChainSolver(chain_, limits_, settings_).solve(indices, targets, seeds, restarts);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].chain = std::move(found[i]);
      unwind(rows[i].seed, limits_, rows[i].chain.q);
    }
  }

  /// Takes the rows together from the chain's solution to the model's, as long as every step helps much: the Jacobian
  /// is the chain's in the deflected posture, so what is left of the error is the share by which the deflection
  /// changes.
  void approach(std::vector<Row>& rows, const Samples& samples) const {
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
      for (std::size_t k = 0; k < active.size(); ++k) part.q.row(static_cast<Eigen::Index>(k)) = q[k].transpose();
      settle(model_, theta_, 1, part, how);
      const bool deflected = how.goes_on && !part.frames.empty();  // the first call begins with the undeflected arm
      how.goes_on = model_.at_equilibrium();
      how.tolerance = std::max(how.tolerance * kEquilibriumGain, kEquilibrium);
      std::vector<std::size_t> still;
      std::vector<JointVector> next;
      kept.clear();
      for (std::size_t k = 0; k < active.size(); ++k) {
        Row& row = rows[active[k]];
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

  /// The end of one row, from what its chain gave.
  IkStatus finish(const Row& row, ModelFrames& frames, bool may_jump, SearchPoint& best) const {
    if (bare_ && row.chain.reached && row.chain.least_singular_value > near_singular()) {
      best.q = row.chain.q;
      best.position_error = row.chain.position_error;
      best.rotation_error = row.chain.rotation_error;
      best.evaluations = row.chain.evaluations;
      return IkStatus::kReached;
    }
    frames.choose(row.index);
    const FramesAt frames_at = [&](const JointVector& q) -> const std::vector<Pose>& { return frames.at(q); };
    Goal goal = goal_of(row);
    const JointLimits box = held_at(row.seed, limits_);
    if (row.model.reached)
      best = row.model;
    else
      best = search_pose(chain_, frames_at, goal, box, row.chain.q, kLastEvaluations);
    int evaluations = row.chain.evaluations + best.evaluations;
    const auto try_others = [&](const JointLimits& limits, int seeds, int restarts) {
      for (const JointVector& from : chain_solutions(row, limits, seeds, restarts, evaluations)) {
        SearchPoint found = search_pose(chain_, frames_at, goal, held_at(row.seed, limits), from, kEvaluations);
        evaluations += found.evaluations;
        if (found.reached) return found;
      }
      return SearchPoint();
    };
    const auto take = [&](SearchPoint found) {
      if (found.reached) best = std::move(found);
    };
    if (!best.reached && !bare_ && may_jump && row.chain.reached) take(try_others(limits_, kOthers, 0));
    IkStatus status = IkStatus::kReached;
    if (!best.reached) {
      if (bare_) unwind(row.seed, limits_, best.q);
      status = try_others(unlimited_, kOthers, 0).reached ? IkStatus::kLimit : IkStatus::kUnreachable;
      // Where only few of the postures lead to a solution within the limits, some luck may have been missing.
      if (status == IkStatus::kLimit && may_jump) take(try_others(limits_, 1, kPersistence * options_.restarts));
    }
    if (best.reached) {
      status = IkStatus::kReached;
      if (least_singular_value(chain_, best.J, options_.reach) < near_singular()) {
        goal.tolerance_position = kFinest * options_.reach;
        goal.tolerance_rotation = kFinest;
        const SearchPoint end = search_pose(chain_, frames_at, goal, box, best.q, kLastEvaluations);
        if (least_singular_value(chain_, end.J, options_.reach) < kSingular) status = IkStatus::kSingular;
      }
    }
    best.evaluations = evaluations;
    return status;
  }

 private:
  Goal goal_of(const Row& row) const {
    return {row.target, options_.reach, options_.tolerance_position, options_.tolerance_rotation};
  }

  bool is_held(Eigen::Index joint) const {
    return !options_.held.empty() && options_.held[static_cast<std::size_t>(joint)];
  }

  /// The limits, of joints that are held the seed (as far as the limits have it).
  JointLimits held_at(const JointVector& seed, const JointLimits& limits) const {
    JointLimits out = limits;
    for (Eigen::Index i = 0; i < seed.size(); ++i) {
      if (is_held(i)) out.row(i).setConstant(std::clamp(seed[i], limits_(i, 0), limits_(i, 1)));
    }
    return out;
  }

  /// A singular posture found to a tolerance has a least singular value of about its root.
  double near_singular() const {
    return 10 * std::sqrt(std::max(options_.tolerance_position / options_.reach, options_.tolerance_rotation));
  }

  /// Solutions of the chain alone from the first postures of the row's sequence.
  std::vector<JointVector> chain_solutions(const Row& row, const JointLimits& limits, int count, int restarts,
                                           int& evaluations) const {
    const ChainSolver solver(chain_, limits, settings_);
    const ChainSolver within(chain_, limits_, settings_);
    const std::vector<Eigen::Index> indices(static_cast<std::size_t>(count), row.index);
    const std::vector<Pose> targets(static_cast<std::size_t>(count), row.target);
    std::vector<JointVector> seeds{row.chain.q};
    for (int k = 1; k < count; ++k) {
      seeds.push_back(within.restart(row.index, k));
      for (Eigen::Index i = 0; i < row.seed.size(); ++i) {
        if (is_held(i)) seeds.back()[i] = row.seed[i];
      }
    }
    std::vector<JointVector> out;
    for (ChainSolution& found : solver.solve(indices, targets, seeds, restarts)) {
      evaluations += found.evaluations;
      if (!found.reached) continue;
      unwind(row.seed, limits, found.q);
      out.push_back(std::move(found.q));
    }
    return out;
  }

  /// Takes whole turns out of revolute joints, as far as the limits let them come nearer to the seed.
  void unwind(const JointVector& seed, const JointLimits& limits, JointVector& q) const {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      if (chain_.joint_types[static_cast<std::size_t>(i)] != JointType::kRevolute) continue;
      const double turns = std::round((q[i] - seed[i]) / (2 * M_PI));
      const double to = q[i] - turns * 2 * M_PI;
      if (turns != 0 && to >= limits(i, 0) && to <= limits(i, 1)) q[i] = to;
    }
  }

  const ErrorModel& model_;
  const Eigen::VectorXd& theta_;
  const IkOptions& options_;
  Chain chain_;
  JointLimits limits_, unlimited_;
  bool bare_;
  ChainSettings settings_;
};

bool to_target(const double* numbers, Pose& target) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(numbers);
  if (!T.allFinite() || T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return false;
  target = {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  const Eigen::Matrix3d excess = target.R.transpose() * target.R - Eigen::Matrix3d::Identity();
  if (excess.cwiseAbs().maxCoeff() > kNotRotation || target.R.determinant() < 0) return false;
  target.R -= 0.5 * target.R * excess;  // rounded numbers: a Newton step to the nearest rotation
  return true;
}

}  // namespace

IkResult inverse_kinematics(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta_in,
                            const Samples& samples, const Eigen::Ref<const RowMatrixXd>& targets,
                            const IkOptions& options) {
  const int n = model.robot().joint_count();
  const Eigen::Index rows = targets.rows();
  samples.check(n);
  FASTCAL_CHECK(n <= kMaxIkJoints) << "inverse kinematics takes arms of at most " << kMaxIkJoints << " joints, got "
                                   << n;
  FASTCAL_CHECK(samples.count() == rows && targets.cols() == 16)
      << "targets must be (N, 4, 4) with a row of conditions each, got " << rows << " and " << samples.count();
  FASTCAL_CHECK(options.limits.rows() == n && options.limits.cols() == 2) << "limits must have shape (" << n << ", 2)";
  FASTCAL_CHECK(options.held.empty() || static_cast<int>(options.held.size()) == n)
      << "held must be one a joint (" << n << "), got " << options.held.size();
  FASTCAL_CHECK((options.limits.col(0).array() <= options.limits.col(1).array()).all())
      << "a lower limit must not lie above the upper one";
  const Eigen::VectorXd theta = theta_in;
  IkResult out;
  out.q = samples.q;
  out.status.assign(static_cast<std::size_t>(rows), static_cast<int>(IkStatus::kBadTarget));
  out.iterations = Eigen::VectorXi::Zero(rows);
  out.position_error = out.rotation_error = Eigen::VectorXd::Constant(rows, std::numeric_limits<double>::quiet_NaN());
  const Solver solver(model, theta, options);
  const auto solve_rows = [&](Eigen::Index begin, Eigen::Index end, bool follows) {
    std::vector<Row> wanted;
    for (Eigen::Index i = begin; i < end; ++i) {
      if (follows) out.q.row(i) = out.q.row(i - 1);
      Row row{i, {}, out.q.row(i).transpose(), {}, {}};
      if (to_target(targets.row(i).data(), row.target)) wanted.push_back(std::move(row));
    }
    const bool may_jump = !follows && options.restarts > 0;
    solver.solve_chain(wanted, may_jump ? options.restarts : 0);
    if (!model.effects().empty()) solver.approach(wanted, samples);
    ModelFrames frames(model, theta, samples);
    for (const Row& row : wanted) {
      SearchPoint found;
      const IkStatus status = solver.finish(row, frames, may_jump, found);
      out.status[static_cast<std::size_t>(row.index)] = static_cast<int>(status);
      out.q.row(row.index) = found.q.transpose();
      out.iterations[row.index] = found.evaluations;
      out.position_error[row.index] = found.position_error;
      out.rotation_error[row.index] = found.rotation_error;
    }
  };
  if (options.along_path) {
    for (Eigen::Index i = 0; i < rows; ++i) solve_rows(i, i + 1, i > 0);
  } else {
    parallel_chunks(rows, options.threads,
                    [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) { solve_rows(begin, end, false); });
  }
  return out;
}

void joint_jacobian(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, const Samples& samples,
                    int threads, double* J) {
  const int n = model.robot().joint_count();
  samples.check(n);
  const Chain chain = model.robot().chain(theta.head(model.robot().nominal().size()));
  parallel_chunks(samples.count(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    RowEvaluator rows(model, theta);
    Samples part = samples.slice(begin, end);
    settle(model, theta, 1, part);
    for (Eigen::Index i = begin; i < end; ++i)
      Eigen::Map<RowMatrixXd>(J + i * 6 * n, 6, n) = joint_jacobian(chain, rows.frames(part.row(i - begin)));
  });
}

}  // namespace fastcal
