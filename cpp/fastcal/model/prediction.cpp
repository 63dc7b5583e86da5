// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/prediction.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <vector>

#include "fastcal/kernels/streams.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/model/row_block.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {
namespace {

void check(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta) {
  samples.check_shapes(model.robot().tree());
  FASTCAL_CHECK(theta.size() == model.parameter_count())
      << "the model has " << model.parameter_count() << " parameters, got " << theta.size();
}

void check(const ErrorModel& model, const View& view) {
  const int frames = model.robot().frame_count();
  for (const int frame : {view.target, view.sensor})
    FASTCAL_CHECK(frame >= kWorldFrame && frame < frames) << "a frame must be 0 to " << frames - 1 << ", got " << frame;
}

/// parameter_jacobian() from a sensor that the robot carries, row by row.
void relative_jacobian(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
                       const View& view, int rows, int threads, double* J) {
  const Eigen::Index p = model.parameter_count();
  samples.check_finite(0, samples.count());
  Samples settled = samples;
  settle(model, theta, threads, settled);
  parallel_chunks(samples.count(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    RowEvaluator evaluator(model, theta);
    Eigen::Matrix<double, 6, Eigen::Dynamic> motion(6, p);
    for (Eigen::Index i = begin; i < end; ++i) {
      evaluator.jacobian(settled.row(i), view, motion);
      Eigen::Map<RowMatrixXd>(J + i * rows * p, rows, p) = motion.topRows(rows);
    }
  });
}

/// Brings the frames of rows begin ... end - 1 up to date, with the loads that the effects need.
void forward(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, const Samples& samples,
             Eigen::Index begin, Eigen::Index end, RowBlock& block) {
  if (model.needs() == kNothing) return block.forward(samples, begin, end, nullptr);
  samples.check_finite(begin, end);
  Samples part = samples.slice(begin, end);
  settle(model, theta, 1, part);
  block.forward(part, 0, end - begin, nullptr);
}

}  // namespace

void predict(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
             const View& view, int threads, double* poses) {
  check(model, samples, theta);
  check(model, view);
  // A wrench at the tool is for the rounds of settle().
  const std::optional<JointSprings> springs = samples.wrench.size() == 0 ? model.springs(theta) : std::nullopt;
  const bool past_caches = kernels::is_beyond_caches(16 * samples.count());
  struct Worker {
    RowBlock block;
    std::optional<RowBlock> with_springs;
    AlignedNumbers poses;
    Worker(const ErrorModel& of, const Eigen::Ref<const Eigen::VectorXd>& at,
           const std::optional<JointSprings>& springs)
        : block(of, at, {}, {}, RowBlock::Frames::kNone) {
      if (springs)
        with_springs.emplace(of, at, std::vector<int>(), Eigen::VectorXd(), RowBlock::Frames::kNone, &*springs);
    }
    ~Worker() { kernels::finish_copies(); }
  };
  parallel_chunks(
      samples.count(), threads, [&] { return Worker(model, theta, springs); },
      [&](Worker& worker, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
        const auto write = [&](RowBlock& block) {
          const Eigen::Index count = 16 * (end - begin);
          double* out = past_caches ? worker.poses.resize(count) : poses + 16 * begin;
          block.write_seen(view, out);
          if (past_caches) kernels::copy_past_caches(out, count, poses + 16 * begin);
        };
        if (worker.with_springs) {
          worker.with_springs->forward(samples, begin, end, nullptr);
          if (worker.with_springs->settled()) return write(*worker.with_springs);
        }
        forward(model, theta, samples, begin, end, worker.block);
        write(worker.block);
      });
}

void parameter_jacobian(const ErrorModel& model, const Samples& samples, const Eigen::Ref<const Eigen::VectorXd>& theta,
                        const View& view, int rows, int threads, double* J) {
  check(model, samples, theta);
  check(model, view);
  FASTCAL_CHECK(rows == 3 || rows == 6) << "a parameter Jacobian has 3 or 6 rows a sample, got " << rows;
  const Eigen::Index p = model.parameter_count();
  if (view.sensor != kWorldFrame || view.target == kWorldFrame)
    return relative_jacobian(model, samples, theta, view, rows, threads, J);
  std::vector<int> all(static_cast<std::size_t>(p));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::VectorXd scale = Eigen::VectorXd::Ones(p);
  const bool past_caches = kernels::is_beyond_caches(samples.count() * rows * p);
  struct Worker {
    RowBlock block;
    ~Worker() { kernels::finish_copies(); }
  };
  parallel_chunks(
      samples.count(), threads, [&] { return Worker{RowBlock(model, theta, all, scale, RowBlock::Frames::kNone)}; },
      [&](Worker& worker, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
        forward(model, theta, samples, begin, end, worker.block);
        const auto numbers = rows == 3 ? kernels::ToolNumbers::kPosition : kernels::ToolNumbers::kPose;
        worker.block.write_jacobian(view.target, numbers, past_caches, J + begin * rows * p);
      });
}

}  // namespace fastcal
