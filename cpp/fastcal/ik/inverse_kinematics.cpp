// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/ik/inverse_kinematics.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "fastcal/ik/pose_search.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

constexpr int kEvaluations = 60;        // of one search; most that succeed need 10
constexpr int kLastEvaluations = 400;   // of the search for the nearest pose
constexpr int kFreeRestarts = 20;       // that show whether the limits are to blame
constexpr double kSingular = 1e-6;      // least singular value, lengths over the reach
constexpr double kNearSingular = 1e-2;  // below, it is found out how small it can become
constexpr double kFinest = 1e-15;       // [rad], of the reach
constexpr double kNotRotation = 1e-6;   // R R^T - 1

/// One row of conditions, whose joint positions change.
class OneRow {
 public:
  OneRow(const ErrorModel& model, const Eigen::VectorXd& theta, Samples sample)
      : model_(model), theta_(theta), sample_(std::move(sample)), evaluator_(model, theta) {}

  const std::vector<Pose>& frames(const JointVector& q) {
    sample_.q.row(0) = q.transpose();
    settle(model_, theta_, 1, sample_);
    return evaluator_.frames(sample_.row(0));
  }

 private:
  const ErrorModel& model_;
  const Eigen::VectorXd& theta_;
  Samples sample_;
  RowEvaluator evaluator_;
};

/// Numbers even in [0, 1) that depend on what they are counted by and on nothing else (G. Steele et al., "Fast
/// splittable pseudorandom number generators", 2014).
double hashed(std::uint64_t seed, std::uint64_t row, std::uint64_t joint) {
  std::uint64_t z = seed * 0xD1342543DE82EF95u + row * 0x9E3779B97F4A7C15u + (joint + 1) * 0xDA942042E4DD58B5u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

class Solver {
 public:
  Solver(const ErrorModel& model, const Eigen::VectorXd& theta, const IkOptions& options)
      : model_(model),
        theta_(theta),
        options_(options),
        chain_(model.robot().chain(theta.head(model.robot().nominal().size()))),
        limits_(options.limits),
        free_(options.limits) {
    for (Eigen::Index i = 0; i < limits_.rows(); ++i) {
      const bool revolute = chain_.joint_types[static_cast<std::size_t>(i)] == JointType::kRevolute;
      free_.row(i) << -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity();
      const double far = revolute ? M_PI : options.reach;
      low_.push_back(std::isfinite(limits_(i, 0)) ? limits_(i, 0) : -far);
      high_.push_back(std::isfinite(limits_(i, 1)) ? limits_(i, 1) : far);
    }
  }

  IkStatus solve(Eigen::Index row, const Samples& sample, const Pose& target, int restarts, SearchPoint& best) const {
    OneRow one(model_, theta_, sample);
    std::vector<Pose> frames;
    const FramesAt chain_at = [&](const JointVector& q) -> const std::vector<Pose>& {
      forward(chain_, q.data(), nullptr, frames);
      return frames;
    };
    const FramesAt model_at = [&](const JointVector& q) -> const std::vector<Pose>& { return one.frames(q); };
    const bool bare = model_.effects().empty();
    Goal goal{target, options_.reach, options_.tolerance_position, options_.tolerance_rotation};
    const JointVector seed = sample.q.row(0).transpose();
    int evaluations = 0;
    const auto attempt = [&](const JointVector& from, const JointLimits& limits) {
      SearchPoint found = search_pose(chain_, chain_at, goal, limits, from, kEvaluations);
      evaluations += found.evaluations;
      unwind(seed, limits, found.q);
      if (!bare) {
        found = search_pose(chain_, model_at, goal, limits, found.q, kEvaluations);
        evaluations += found.evaluations;
      }
      return found;
    };
    bool reached = false;
    for (int k = 0; k <= restarts && !reached; ++k) {
      SearchPoint found = attempt(k == 0 ? within(seed) : start(row, k), limits_);
      if (k == 0 || found.cost < best.cost) best = std::move(found);
      reached = best.reached;
    }
    const FramesAt& frames_at = bare ? chain_at : model_at;
    IkStatus status = IkStatus::kReached;
    if (!reached) {
      best = search_pose(chain_, frames_at, goal, limits_, best.q, kLastEvaluations);
      evaluations += best.evaluations;
      if (bare) unwind(seed, limits_, best.q);
      status = IkStatus::kUnreachable;
      for (int k = 0; k <= kFreeRestarts && status != IkStatus::kLimit; ++k) {
        if (attempt(k == 0 ? best.q : start(row, k), free_).reached) status = IkStatus::kLimit;
      }
    } else if (least_singular_value(chain_, best.J, options_.reach) < kNearSingular) {
      goal.tolerance_position = kFinest * options_.reach;
      goal.tolerance_rotation = kFinest;
      const SearchPoint end = search_pose(chain_, frames_at, goal, limits_, best.q, kLastEvaluations);
      if (least_singular_value(chain_, end.J, options_.reach) < kSingular) status = IkStatus::kSingular;
    }
    best.evaluations = evaluations;
    return status;
  }

 private:
  JointVector within(const JointVector& q) const { return q.cwiseMax(limits_.col(0)).cwiseMin(limits_.col(1)); }

  /// Takes whole turns out of revolute joints, as far as the limits let them come nearer to the seed.
  void unwind(const JointVector& seed, const JointLimits& limits, JointVector& q) const {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      if (chain_.joint_types[static_cast<std::size_t>(i)] != JointType::kRevolute) continue;
      const double turns = std::round((q[i] - seed[i]) / (2 * M_PI));
      const double to = q[i] - turns * 2 * M_PI;
      if (turns != 0 && to >= limits(i, 0) && to <= limits(i, 1)) q[i] = to;
    }
  }

  /// Posture k of the row's quasi-random sequence: a Kronecker sequence of the generalised golden ratio, shifted.
  JointVector start(Eigen::Index row, int k) const {
    const Eigen::Index n = limits_.rows();
    double golden = 2;  // golden^(n + 1) = golden + 1
    for (int i = 0; i < 60; ++i) golden = std::pow(1 + golden, 1 / static_cast<double>(n + 1));
    JointVector q(n);
    double ratio = 1;
    for (Eigen::Index i = 0; i < n; ++i) {
      ratio /= golden;
      const double u =
          hashed(options_.random_seed, static_cast<std::uint64_t>(row), static_cast<std::uint64_t>(i)) + k * ratio;
      const auto j = static_cast<std::size_t>(i);
      q[i] = low_[j] + (u - std::floor(u)) * (high_[j] - low_[j]);
    }
    return q;
  }

  const ErrorModel& model_;
  const Eigen::VectorXd& theta_;
  const IkOptions& options_;
  Chain chain_;
  JointLimits limits_, free_;
  std::vector<double> low_, high_;
};

bool to_target(const double* numbers, Pose& target) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(numbers);
  if (!T.allFinite() || T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return false;
  target = {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  return (target.R * target.R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kNotRotation &&
         target.R.determinant() > 0;
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
  FASTCAL_CHECK((options.limits.col(0).array() <= options.limits.col(1).array()).all())
      << "a lower limit must not lie above the upper one";
  const Eigen::VectorXd theta = theta_in;
  IkResult out;
  out.q = samples.q;
  out.status.assign(static_cast<std::size_t>(rows), static_cast<int>(IkStatus::kBadTarget));
  out.iterations = Eigen::VectorXi::Zero(rows);
  out.position_error = out.rotation_error = Eigen::VectorXd::Constant(rows, std::numeric_limits<double>::quiet_NaN());
  const Solver solver(model, theta, options);
  const auto solve_rows = [&](Eigen::Index begin, Eigen::Index end, bool follow) {
    for (Eigen::Index i = begin; i < end; ++i) {
      Samples sample = samples.slice(i, i + 1);
      if (follow && i > begin) out.q.row(i) = sample.q.row(0) = out.q.row(i - 1);
      Pose target;
      if (!to_target(targets.row(i).data(), target)) continue;
      SearchPoint found;
      const int restarts = follow && i > begin ? 0 : options.restarts;
      out.status[static_cast<std::size_t>(i)] = static_cast<int>(solver.solve(i, sample, target, restarts, found));
      out.q.row(i) = found.q.transpose();
      out.iterations[i] = found.evaluations;
      out.position_error[i] = found.error.head<3>().norm();
      out.rotation_error[i] = found.error.tail<3>().norm();
    }
  };
  if (options.along_path) {
    solve_rows(0, rows, true);
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
