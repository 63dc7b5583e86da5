// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/alignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fastcal/identification/solver.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/decompositions.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/model/row_block.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

constexpr double kToolReach = 0.3;          // [m] a tool's plausible size
constexpr double kToolNearNominal = 0.02;   // [m] standard deviation of a tool that the rows do not show
constexpr double kTurningThatShows = 3e-3;  // [rad] RMS: separates a tool's size from an arm's errors of a millimetre

constexpr int kCalmingRounds = 10;
constexpr double kCalmer = 0.8;  // of the level before: less is worth another solve

/// A row with what it measures of the tool's pose.
struct Row : MeasuredPose {
  Pose T_base_flange;
};

/// Mean and second moments of z = [f; columns of R; p] over the rows with a point, f and R the flange's pose in the
/// base, p the measured point: the closed forms below need the rows no more.
struct PointMoments {
  static constexpr int kSize = 15;
  Eigen::Matrix<double, kSize, 1> mean = Eigen::Matrix<double, kSize, 1>::Zero();
  Eigen::Matrix<double, kSize, kSize> sums = Eigen::Matrix<double, kSize, kSize>::Zero();  // about the mean
  double count = 0;

  explicit PointMoments(const std::vector<Row>& rows) {
    const auto visit = [&rows](const auto& take) {
      Eigen::Matrix<double, kSize, 1> z;
      for (const Row& row : rows) {
        if (!row.has_point) continue;
        z << row.T_base_flange.p, row.T_base_flange.R.reshaped(), row.p_world_tool;
        take(z);
      }
    };
    visit([this](const auto& z) {
      mean += z;
      ++count;
    });
    if (count > 0) mean /= count;
    visit([this](const auto& z) {
      const Eigen::Matrix<double, kSize, 1> apart = z - mean;
      sums.noalias() += apart * apart.transpose();
    });
  }

  Eigen::Vector3d flange() const { return mean.head<3>(); }
  Eigen::Matrix3d turn() const { return mean.segment<9>(3).reshaped(3, 3); }
  Eigen::Vector3d point() const { return mean.tail<3>(); }

  // Places in z.
  static constexpr int kFlange = 0, kPoint = 12;
  static constexpr int column(int c) { return 3 + 3 * c; }
  Eigen::Matrix3d between(int a, int b) const { return sums.block<3, 3>(a, b); }
};

/// Base pose for given tool point t: p_i = R (f_i + R_i t) + p (W. Kabsch 1976).
Pose fit_base(const PointMoments& of, const Eigen::Vector3d& t) {
  constexpr int kPoint = PointMoments::kPoint;
  Eigen::Matrix3d M = of.between(kPoint, PointMoments::kFlange);
  for (int c = 0; c < 3; ++c) M += t[c] * of.between(kPoint, PointMoments::column(c));
  const Eigen::Matrix3d R = nearest_rotation(M);
  return {R, of.point() - R * (of.flange() + of.turn() * t)};
}

/// Base position and tool point for a given base rotation: linear, and without the means in the tool point alone. It is
/// kept near t_0 with a ridge: where the flange hardly turns, an arm off by a millimetre would move it by kilometres.
void fit_points(const PointMoments& of, const Eigen::Matrix3d& R_base, const Eigen::Vector3d& t_0, Pose& base,
                Eigen::Vector3d& t) {
  Eigen::Matrix3d A;
  Eigen::Vector3d b;
  for (int r = 0; r < 3; ++r) {
    const int column = PointMoments::column(r);
    for (int c = 0; c < 3; ++c) A(r, c) = of.between(column, PointMoments::column(c)).trace();
    b[r] = (of.between(column, PointMoments::kPoint) * R_base).trace() -
           of.between(column, PointMoments::kFlange).trace() - A.row(r).dot(t_0);
  }
  A += of.count * kTurningThatShows * kTurningThatShows * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d change = solve(Eigen::LDLT<Eigen::MatrixXd>(Eigen::MatrixXd(A)), b);
  t = t_0 + change;
  base = {R_base, of.point() - R_base * (of.flange() + of.turn() * t)};
}

/// The tool's rotation for a given base rotation, in the mean over the rows; `nominal` where none was measured.
Eigen::Matrix3d fit_tool_rotation(const std::vector<Row>& rows, const Eigen::Matrix3d& R_base,
                                  const Eigen::Matrix3d& nominal) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const Row& row : rows) {
    if (row.has_rotation) M += (R_base * row.T_base_flange.R).transpose() * row.R_world_tool;
  }
  return M.isZero(0) ? nominal : nearest_rotation(M);
}

/// The rotation part of the lifted linear problem, p = X [f; columns of R] + x with X = [R_base, R_base t_0, ...];
/// false where its 13 unknowns are not all shown.
bool lifted_rotation(const PointMoments& of, Eigen::Matrix3d& R_base) {
  constexpr double kShown = 1e-8;  // of the largest pivot
  constexpr int kKnown = PointMoments::kPoint;
  if (of.count <= kKnown) return false;
  const Eigen::LDLT<Eigen::MatrixXd> factor(Eigen::MatrixXd(of.sums.topLeftCorner<kKnown, kKnown>()));
  const Eigen::VectorXd pivots = factor.vectorD();
  if (pivots.minCoeff() < kShown * std::max(pivots.maxCoeff(), of.count)) return false;
  const Eigen::MatrixXd X = solve(factor, of.sums.topRightCorner<kKnown, 3>());
  R_base = nearest_rotation(X.topRows<3>().transpose());
  return true;
}

/// R_base and R_tool of R_i^w = R_b R_i R_t; false where fewer than two directions of turning are shown.
bool fit_rotations(const std::vector<Row>& rows, Eigen::Matrix3d& R_base, Eigen::Matrix3d& R_tool) {
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(9, 9);
  for (const Row& row : rows) {
    if (!row.has_rotation) continue;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        for (int c = 0; c < 3; ++c) {
          for (int d = 0; d < 3; ++d) K(3 * a + b, 3 * c + d) += row.R_world_tool(a, d) * row.T_base_flange.R(b, c);
        }
      }
    }
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(K, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()[1] > 0.999 * svd.singularValues()[0]) return false;
  Eigen::Matrix3d B =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(svd.matrixU().col(0).eval().data());
  Eigen::Matrix3d X =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(svd.matrixV().col(0).eval().data());
  if (B.determinant() < 0) {
    B = -B;
    X = -X;
  }
  R_base = nearest_rotation(B);
  R_tool = nearest_rotation(X);
  return true;
}

/// Median distance of the points, or of the turns where only orientations were measured: what outliers cannot move.
double misfit(const std::vector<Row>& rows, const Pose& base, const Pose& tool) {
  std::vector<double> squares;
  for (const Row& row : rows) {
    if (row.has_point) squares.push_back((base * (row.T_base_flange * tool.p) - row.p_world_tool).squaredNorm());
    if (!row.has_point && row.has_rotation)
      squares.push_back((base.R * row.T_base_flange.R * tool.R - row.R_world_tool).squaredNorm() / 2);
  }
  std::nth_element(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2), squares.end());
  return std::sqrt(squares[squares.size() / 2]);
}

/// [m] RMS over rows of what is left of the first observation in m that a row has.
double rms_of_rows(const Measurements& measured, const RowMatrixXd& r) {
  double sum = 0;
  double count = 0;
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    for (const PlacedObservation& of : measured.observations()) {
      const auto part = r.row(i).segment(of.first_number, of.component_count);
      if (of->unit() != "m" || part.hasNaN()) continue;
      sum += part.squaredNorm();
      ++count;
      break;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

/// Median length of the rows' residuals: points, or whatever else was measured in a row without a whole one.
double median_length(const Measurements& measured, const RowMatrixXd& r) {
  std::vector<double> lengths;
  const Eigen::Index points = measured.observations().front()->coordinates() != nullptr ? 3 : 0;
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    const bool has_point = points > 0 && !r.row(i).head(points).hasNaN();
    double squares = 0;
    for (Eigen::Index c = has_point ? 0 : points; c < (has_point ? points : r.cols()); ++c) {
      if (!std::isnan(r(i, c))) squares += r(i, c) * r(i, c);
    }
    if (squares > 0) lengths.push_back(std::sqrt(squares));
  }
  if (lengths.empty()) return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

std::vector<Row> rows_of(const Problem& problem) {
  const RobotModel& robot = problem.model.robot();
  FASTCAL_CHECK(robot.tree().is_arm()) << "base and tool are of one arm, got a tree of frames";
  const Pose base_back = robot.description().T_world_base.inverse();
  const Pose tool_back = robot.description().T_flange_tool.inverse();
  std::vector<Row> rows(static_cast<std::size_t>(problem.row_count()));
  const int tool = robot.frame_count() - 1;
  const auto worker = [&] { return RowBlock(problem.model, problem.model.start(), {}, {}); };
  parallel_chunks(problem.row_count(), problem.threads, worker,
                  [&](RowBlock& nominal, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
                    nominal.forward(problem.samples, begin, end, nullptr);
                    for (Eigen::Index i = begin; i < end; ++i) {
                      Row& row = rows[static_cast<std::size_t>(i)];
                      row.T_base_flange = base_back * nominal.frame(tool, static_cast<int>(i - begin)) * tool_back;
                      for (const PlacedObservation& of : problem.measured.observations()) of->add_pose(i, row);
                    }
                  });
  return rows;
}

/// Do two starts lead to the same end? They differ by less than what refining moves.
bool alike(const Pose& a, const Pose& b) {
  constexpr double kAlike = 1e-4;  // [m], [rad]
  return (a.p - b.p).norm() < kAlike && (a.R - b.R).norm() < kAlike;
}

}  // namespace

std::string start_unknowns(const Problem& problem, Eigen::VectorXd& unknowns) {
  unknowns = Eigen::VectorXd::Zero(problem.measured.unknown_count());
  if (unknowns.size() == 0) return "";
  std::vector<std::vector<Pose>> frames;
  RowEvaluator evaluator(problem.model, problem.model.start());
  for (Eigen::Index i = 0; i < problem.row_count(); ++i) frames.push_back(evaluator.frames(problem.samples.row(i)));
  for (const PlacedObservation& of : problem.measured.observations()) {
    if (of.unknown_count == 0) continue;
    std::vector<Sights> sights;
    sights.reserve(frames.size());
    for (const auto& T : frames) sights.push_back(sights_of(of, [&](int frame) { return T[frame]; }));
    std::string missing = of->start(sights, unknowns.segment(of.first_unknown, of.unknown_count));
    if (!missing.empty()) return missing;
  }
  return "";
}

Alignment align(const Problem& given) {
  given.check();
  // Loads of the arm as it starts: where it stands turns gravity, but hardly what the arm looks like.
  Samples settled;
  if (given.model.needs() != kNothing) {
    settled = given.samples;
    settle(given.model, given.model.start(), given.threads, settled);
  }
  const Problem problem{given.model, given.model.needs() != kNothing ? settled : given.samples, given.measured,
                        given.threads};
  const RobotDescription& robot = problem.model.robot().description();
  const std::vector<Row> rows = rows_of(problem);
  const auto points = std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.has_point; });
  const auto rotations = std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.has_rotation; });

  struct Candidate {
    Pose base, tool;
    double misfit = 0;
  };
  std::vector<Candidate> candidates;
  // Among starts that fit alike, because the rows do not show the tool, the one near the nominal tool.
  const auto add = [&](const Pose& base, const Pose& tool) {
    const auto known = [&](const Candidate& other) { return alike(other.base, base) && alike(other.tool, tool); };
    if (std::any_of(candidates.begin(), candidates.end(), known)) return;
    const double moved = (tool.p - robot.T_flange_tool.p).norm();
    candidates.push_back({base, tool, std::hypot(misfit(rows, base, tool), kTurningThatShows * moved)});
  };

  const PointMoments moments(rows);
  Pose tool = robot.T_flange_tool;
  Pose base = robot.T_world_base;
  Eigen::Matrix3d R_base = base.R;
  if (rotations >= 3 && fit_rotations(rows, R_base, tool.R)) {
    base.R = R_base;
    if (points >= 3) fit_points(moments, R_base, tool.p, base, tool.p);
    add(base, tool);
  }
  if (points >= 3) {
    const Eigen::Vector3d t_0 = robot.T_flange_tool.p;
    if (lifted_rotation(moments, R_base)) {
      fit_points(moments, R_base, t_0, base, tool.p);
      add(base, {fit_tool_rotation(rows, R_base, tool.R), tool.p});
    }
    // Starts that need no well spread rows: the nominal tool, no tool, and tools along each axis.
    std::vector<Eigen::Vector3d> tools{t_0, Eigen::Vector3d::Zero()};
    for (int axis = 0; axis < 3; ++axis) {
      for (const double reach : {-kToolReach, kToolReach}) tools.emplace_back(reach * Eigen::Vector3d::Unit(axis));
    }
    for (const Eigen::Vector3d& t : tools) {
      Pose fitted = fit_base(moments, t);
      Eigen::Vector3d t_fitted = t;
      for (int round = 0; round < 20; ++round) {  // alternate: each step is the exact minimum over its part
        fit_points(moments, fitted.R, t_0, fitted, t_fitted);
        fitted = fit_base(moments, t_fitted);
      }
      add(fitted, {fit_tool_rotation(rows, fitted.R, tool.R), t_fitted});
    }
  }

  Alignment out;
  out.T_world_base = robot.T_world_base;
  out.T_flange_tool = robot.T_flange_tool;
  if (candidates.empty() && problem.measured.unknown_count() == 0) {
    out.message = "base and tool need at least three measured points or orientations, got " + std::to_string(points) +
                  " and " + std::to_string(rotations);
    return out;
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.misfit < b.misfit; });
  if (candidates.empty()) candidates.push_back({robot.T_world_base, robot.T_flange_tool, 0});
  candidates.resize(std::min<std::size_t>(candidates.size(), 3));

  // Refine the best starts over base and tool alone, with a robust loss; the least cost wins.
  double best = std::numeric_limits<double>::infinity();
  const double level = std::max(candidates.front().misfit, 1e-6);
  TwistMemory memory;  // effects do not look at base and tool beyond the loads, which are constant here
  memory.prepare(problem.row_count());
  for (const Candidate& candidate : candidates) {
    const ErrorModel model =
        problem.model.with_robot(problem.model.robot().with_base_and_tool(candidate.base, candidate.tool));
    const Problem here{model, problem.samples, problem.measured, problem.threads, nullptr, &memory};
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(here.parameter_count());
    theta.head(model.parameter_count()) = model.start();
    Eigen::VectorXd unknowns;
    out.message = start_unknowns(here, unknowns);
    if (!out.message.empty()) return out;
    theta.tail(unknowns.size()) = unknowns;
    std::vector<int> free;
    const int tool_first = static_cast<int>(model.robot().nominal().size()) - 6;
    if (points + rotations > 0) {
      for (int k = 0; k < 6; ++k) free.push_back(k);
      for (int k = 0; k < (rotations > 0 ? 6 : 3); ++k) free.push_back(tool_first + k);
    }
    for (int k = model.parameter_count(); k < here.parameter_count(); ++k) free.push_back(k);
    Eigen::VectorXd scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(free.size()), 1e-3);
    Weighting weighting;
    weighting.tau.assign(here.measured.observations().size(), level);
    weighting.loss = LossKind::kHuber;
    Limits limits;
    limits.prior_mean = theta;
    // [m], [rad]: only what the rows do not show stays for it.
    limits.prior_sigma = Eigen::VectorXd::Constant(theta.size(), 10.0);
    limits.prior_sigma.segment(tool_first, 3).setConstant(kToolReach);
    Solution solution = solve(here, theta, free, scale, weighting, limits, {Method::kLeastSquares, 30});
    for (int round = 0; round < kCalmingRounds; ++round) {
      // A start that gross points have led astray comes back as their pull falls with the level.
      const double now = std::max(median_length(here.measured, residuals(here, solution.theta)), 1e-6);
      if (!(now < kCalmer * weighting.tau[0])) break;
      weighting.tau.assign(weighting.tau.size(), now);
      solution = solve(here, solution.theta, free, scale, weighting, limits, {Method::kLeastSquares, 30});
    }
    // Of a tool that the rows show in part, as where one joint alone moved, the rest goes back to nominal instead of
    // taking up the arm's own errors. At the level of what is left, a tool that they do show stays.
    const double left = std::max(median_length(here.measured, residuals(here, solution.theta)), 1e-6);
    weighting.tau.assign(weighting.tau.size(), left);
    limits.prior_mean.segment(tool_first, 3) += robot.T_flange_tool.p - candidate.tool.p;
    limits.prior_sigma.segment(tool_first, 3).setConstant(kToolNearNominal);
    solution = solve(here, solution.theta, free, scale, weighting, limits, {Method::kLeastSquares, 30});
    weighting.tau.assign(weighting.tau.size(), level);
    solution.cost = normal_equations(here, solution.theta, free, scale, weighting, false).cost;
    if (!(solution.cost < best)) continue;
    best = solution.cost;
    out.found = true;
    const Chain chain = model.robot().chain(solution.theta.head(model.robot().nominal().size()));
    out.T_world_base = chain.constants[kBaseFrame];
    out.T_flange_tool = chain.constants.back();
    out.unknowns = solution.theta.tail(here.measured.unknown_count());
    out.rms = rms_of_rows(here.measured, residuals(here, solution.theta));
  }
  return out;
}

}  // namespace fastcal
