// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/settle.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fastcal/math/parallel.hpp"
#include "fastcal/robot/statics.hpp"

namespace fastcal {
namespace {

constexpr int kMaxRounds = 60;
constexpr double kSettled = 1e-14;  // of the largest load

/// q behind the gears: q_j (1 + sum of ratio errors).
void fill_output(const ErrorModel& model, const Eigen::VectorXd& theta, Samples& samples) {
  samples.output = samples.q;
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    for (int j = 0; j < model.robot().joint_count(); ++j) samples.output.col(j) += effect->output_error(j, theta.data() + first) * samples.q.col(j);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
}

void fill_compliance(const ErrorModel& model, const Eigen::VectorXd& theta, Eigen::Index i, Samples& samples) {
  const State state = samples.row(i);
  samples.compliance.row(i).setZero();
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    for (int j = 0; j < model.robot().joint_count(); ++j) samples.compliance(i, j) += effect->joint_compliance(state, j, theta.data() + first);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
}

}  // namespace

double settle(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta_in, int threads, Samples& samples) {
  if (model.needs() == kNothing || samples.count() == 0) return 0;
  const Eigen::VectorXd theta = theta_in;
  const RobotDescription& robot = model.robot().description();
  const Chain chain = model.robot().chain(theta.head(model.robot().nominal().size()));
  const Eigen::Index rows = samples.count();
  const Eigen::Index frames = chain.frame_count();
  samples.gravity = gravity_in_world(robot, chain.constants[kBaseFrame]);
  samples.frames.resize(static_cast<std::size_t>(rows * frames));
  samples.load = samples.payload_load = RowMatrixXd::Zero(rows, 6 * frames);
  samples.compliance = RowMatrixXd::Zero(rows, chain.joint_count());
  fill_output(model, theta, samples);

  std::vector<double> changes(static_cast<std::size_t>(chunk_count(rows)), 0.0);
  parallel_chunks(rows, threads, [&](Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
    RowEvaluator evaluator(model, theta);
    Eigen::VectorXd before(6 * frames);
    for (Eigen::Index i = begin; i < end; ++i) {
      const State state = samples.row(i);
      double change = 0;
      for (int round = 0; round < kMaxRounds; ++round) {
        // The first round loads the undeflected arm; each next one the arm as the last loads deflect it.
        const std::vector<Pose>& T = evaluator.frames(state, round > 0);
        std::copy(T.begin(), T.end(), samples.frames.begin() + i * frames);
        before = samples.load.row(i);
        frame_loads(robot, chain, T, state, samples.gravity, samples.load.row(i).data(), samples.payload_load.row(i).data());
        fill_compliance(model, theta, i, samples);
        const double largest = samples.load.row(i).cwiseAbs().maxCoeff();
        change = largest > 0 ? (samples.load.row(i).transpose() - before).cwiseAbs().maxCoeff() / largest : 0;
        if (!model.at_equilibrium() || change <= kSettled) break;
      }
      changes[static_cast<std::size_t>(chunk)] = std::max(changes[static_cast<std::size_t>(chunk)], change);
    }
  });
  return *std::max_element(changes.begin(), changes.end());
}

}  // namespace fastcal
