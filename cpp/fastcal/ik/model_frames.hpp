// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Frames of a whole model, effects and equilibrium included, posture after posture.
#pragma once

#include <vector>

#include "fastcal/ik/bounded_step.hpp"
#include "fastcal/model/settle.hpp"

namespace fastcal {

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
    sample_.q.own().row(0) = q.transpose();
    settle(model_, theta_, 1, sample_);
    return evaluator_.frames(sample_.row(0));
  }

  /// Joint positions of the last posture, passive ones where the loops closed.
  JointVector closed(const JointVector& q) const {
    JointVector out = q;
    for (const int joint : model_.robot().description().passive)
      out[joint] = evaluator_.joints()[static_cast<std::size_t>(joint)];
    return out;
  }

 private:
  const ErrorModel& model_;
  const Eigen::VectorXd& theta_;
  const Samples& samples_;
  Samples sample_;
  RowEvaluator evaluator_;
};

}  // namespace fastcal
