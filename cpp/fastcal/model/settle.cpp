// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/settle.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/model/row_block.hpp"
#include "fastcal/robot/arm_bending.hpp"
#include "fastcal/robot/statics.hpp"

namespace fastcal {
namespace {

constexpr int kMaxRounds = 60;
constexpr double kBent = 1e-10;       // of the arm's length: a posture nearer than this to the last bends the same
constexpr double kLeastScale = 1e-3;  // of the largest: where a group of beams is taken as rigid

/// q behind the gears: q_j (1 + sum of ratio errors).
void fill_output(const ErrorModel& model, const Eigen::VectorXd& theta, Samples& samples) {
  samples.output = samples.q.table();
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    for (int j = 0; j < model.robot().joint_count(); ++j)
      samples.output.col(j) += effect->output_error(j, theta.data() + first) * samples.q.table().col(j);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
}

/// What the effects' weights add to the robot file's.
void fill_weights(const ErrorModel& model, const Eigen::VectorXd& theta, Samples& samples) {
  samples.weights = Weights(model.robot().joint_count());
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    effect->add_weights(theta.data() + first, samples.weights);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
}

/// The factors at which beams are solved: the effects', where these are all 0 the model's own.
Eigen::VectorXd beam_scale(const ErrorModel& model, const Eigen::VectorXd& theta, const ArmBending& beams) {
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(beams.groups().size()));
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    effect->add_beam_scale(theta.data() + first, scale);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
  const double largest = scale.maxCoeff();
  if (!(largest > 0)) return Eigen::VectorXd::Ones(scale.size());
  return scale.cwiseMax(kLeastScale * largest);
}

void fill_compliance(const ErrorModel& model, const Eigen::VectorXd& theta, Eigen::Index i, Samples& samples) {
  const State state = samples.row(i);
  samples.compliance.row(i).setZero();
  Eigen::Index first = model.robot().nominal().size();
  for (const auto& effect : model.effects()) {
    for (int j = 0; j < model.robot().joint_count(); ++j)
      samples.compliance(i, j) += effect->joint_compliance(state, j, theta.data() + first);
    first += static_cast<Eigen::Index>(effect->parameters().size());
  }
}

/// Frames and loads of the rows of a chunk where springs and weights alone decide; false where that found no
/// equilibrium.
bool settle_with_springs(const ErrorModel& model, const Eigen::VectorXd& theta, const JointSprings& springs,
                         Eigen::Index begin, Eigen::Index end, Samples& samples) {
  RowBlock block(model, theta, {}, {}, RowBlock::Frames::kAll, &springs);
  block.forward(samples, begin, end, nullptr);
  if (!block.settled()) return false;
  const int frames = samples.chain->frame_count();
  std::vector<Pose> T(static_cast<std::size_t>(frames));
  for (Eigen::Index i = begin; i < end; ++i) {
    for (int f = 0; f < frames; ++f) T[static_cast<std::size_t>(f)] = block.frame(f, static_cast<int>(i - begin));
    std::copy(T.begin(), T.end(), samples.frames.begin() + i * frames);
    frame_loads(model.robot().description(), *samples.chain, T, samples.row(i), samples.gravity,
                samples.load.row(i).data(), samples.payload_load.row(i).data());
    samples.compliance.row(i) = springs.compliance.transpose();
  }
  return true;
}

}  // namespace

double settle(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta, int threads, Samples& samples) {
  return settle(model, theta, threads, samples, {.needs = model.needs()});
}

double settle(const ErrorModel& model, const Eigen::Ref<const Eigen::VectorXd>& theta_in, int threads, Samples& samples,
              const SettleOptions& options) {
  const unsigned needs = options.needs;
  if (needs == kNothing || samples.count() == 0) return 0;
  const Eigen::VectorXd theta = theta_in;
  const RobotDescription& robot = model.robot().description();
  samples.chain = std::make_shared<const Chain>(model.robot().chain(theta.head(model.robot().nominal().size())));
  const Chain& chain = *samples.chain;
  const Eigen::Index rows = samples.count();
  const Eigen::Index frames = chain.frame_count();
  samples.gravity = gravity_in_world(robot, chain.constants[kBaseFrame]);
  const bool goes_on = options.goes_on && samples.load.rows() == rows;
  samples.frames.resize(static_cast<std::size_t>(rows * frames));
  const Eigen::Index load_numbers = 6 * static_cast<Eigen::Index>(chain.twist_count());
  if (!goes_on) samples.load = samples.payload_load = RowMatrixXd::Zero(rows, load_numbers);
  if (!goes_on) samples.compliance = RowMatrixXd::Zero(rows, chain.joint_count());
  samples.spring = Eigen::VectorXd::Zero(rows);
  fill_output(model, theta, samples);
  fill_weights(model, theta, samples);
  const ArmBending* beams = (needs | model.needs()) & kBending ? robot.bending.get() : nullptr;
  const Eigen::VectorXd scale = beams != nullptr ? beam_scale(model, theta, *beams) : Eigen::VectorXd();
  if (beams != nullptr && !goes_on) samples.bending = RowMatrixXd::Zero(rows, beams->width());
  // A revolute joint feels the moment about its axis, a prismatic one the force along it.
  const int spring_joint = robot.compensator ? robot.compensator->joint : 0;
  const int spring_axis = robot.joint_types[static_cast<std::size_t>(spring_joint)] == JointType::kRevolute ? 5 : 2;

  if (chain.has_loops()) samples.q.own();
  double length = 0;
  for (const Pose& T : chain.constants) length += T.p.norm();

  const bool by_springs = beams == nullptr && (needs & kLoads) != 0 && samples.wrench.size() == 0;
  const std::optional<JointSprings> springs = by_springs ? model.springs(theta) : std::nullopt;
  std::vector<double> changes(static_cast<std::size_t>(chunk_count(rows)), 0.0);
  parallel_chunks(rows, threads, [&](Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
    if (springs && settle_with_springs(model, theta, *springs, begin, end, samples)) return;
    RowEvaluator evaluator(model, theta);
    Eigen::VectorXd before(load_numbers);
    std::vector<Eigen::Vector3d> ends_before(chain.tree->branches().size(), Eigen::Vector3d::Zero());
    for (Eigen::Index i = begin; i < end; ++i) {
      const State state = samples.row(i);
      double change = 0;
      for (int round = 0; round < kMaxRounds; ++round) {
        // The first round loads the undeflected arm; each next one the arm as the last loads deflect it.
        const std::vector<Pose>& T = evaluator.frames(state, goes_on || round > 0, round > (goes_on ? 0 : 1));
        std::copy(T.begin(), T.end(), samples.frames.begin() + i * frames);
        before = samples.load.row(i);
        frame_loads(robot, chain, T, state, samples.gravity, samples.load.row(i).data(),
                    samples.payload_load.row(i).data());
        if (chain.has_loops())
          add_loop_loads(chain, evaluator.loops(), samples.load.row(i).data(), samples.payload_load.row(i).data());
        if (robot.compensator) samples.spring[i] = spring_load(robot, chain, T)[spring_axis];
        if (needs & kCompliance) fill_compliance(model, theta, i, samples);
        double moved = 0;
        for (std::size_t b = 0; b < ends_before.size(); ++b) {
          const Eigen::Vector3d& at = T[static_cast<std::size_t>(chain.tree->branches()[b].end() - 1)].p;
          moved = std::max(moved, (at - ends_before[b]).norm());
          ends_before[b] = at;
        }
        if (beams != nullptr && (round == 0 || moved > kBent * length))
          beams->basis(robot, state, scale.data(), samples.bending.row(i).data());
        const double largest = samples.load.row(i).cwiseAbs().maxCoeff();
        change = largest > 0 ? (samples.load.row(i).transpose() - before).cwiseAbs().maxCoeff() / largest : 0;
        const bool still = (model.needs() & kFrames) == 0 || (round > 0 && moved <= options.tolerance * length);
        if (!model.at_equilibrium() || (change <= options.tolerance && still)) break;
      }
      for (const int joint : chain.passive)
        samples.q.own()(i, joint) = evaluator.joints()[static_cast<std::size_t>(joint)];
      changes[static_cast<std::size_t>(chunk)] = std::max(changes[static_cast<std::size_t>(chunk)], change);
    }
  });
  return *std::max_element(changes.begin(), changes.end());
}

}  // namespace fastcal
