// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The contract of an effect: one physical cause of pose error, as small body twists on frames of the chain. The chain
// alone knows how a twist moves the tool, the measurement alone how the tool moves the residual; no effect knows that
// another exists. Every effect obeys: zero parameters give the nominal robot exactly; derivatives are exact; const and
// stateless; unknown options raise.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fastcal/effects/twist_table.hpp"
#include "fastcal/robot/kinematics.hpp"
#include "fastcal/robot/state.hpp"

namespace fastcal {

/// What an effect looks at beyond the data's own columns; settle() computes it.
enum Need : unsigned {
  kNothing = 0,
  kFrames = 1,      ///< State::chain, frames, gravity
  kLoads = 2,       ///< State::load, payload_load
  kOutput = 4,      ///< State::output
  kCompliance = 8,  ///< State::compliance
  kBending = 16,    ///< State::bending
};

/// An option whose value is a list of numbers, SI; `unit` is "1" for plain ones.
struct ListOption {
  std::string unit;
  std::vector<double> values;
};

class Effect {
 public:
  Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;
  virtual ~Effect() = default;

  virtual const std::vector<Parameter>& parameters() const = 0;

  /// Bits of Need.
  virtual unsigned needs() const { return kNothing; }

  /// Does it yield to loads? What changes the loads and asks for the compliances moves nothing itself.
  virtual bool follows_loads() const { return (needs() & kLoads) != 0 && (needs() & kCompliance) == 0; }

  /// Columns of the data that it cannot do without, beside q: fields of State, "approach2" for that of one joint.
  virtual std::vector<std::string> data_columns() const { return {}; }

  /// Weights w_k of a quadratic penalty, sum w_k theta_k^2 / s^2 with one s for all; 0: free of it. Empty: no penalty.
  virtual std::vector<double> penalty() const { return {}; }

  /// Options by which the numbers keep their meaning on a robot whose geometry has moved; they are kept with them.
  virtual std::map<std::string, ListOption> reference() const { return {}; }

  /// What a reduction ratio adds to k - 1 of a joint (State::output), and what a compliance adds to d q / d torque of
  /// it (State::compliance).
  virtual double output_error(int /*joint*/, const double* /*theta*/) const { return 0; }
  virtual double joint_compliance(const State& /*state*/, int /*joint*/, const double* /*theta*/) const { return 0; }

  /// Does it move joints by joint_compliance() times their loads, in all states the same, and nothing else?
  virtual bool is_spring() const { return false; }

  /// What the effect's weights add to those of the robot file: part of every load from the next settle() on. Is that
  /// all it does, where all loads hold them?
  virtual bool is_weight() const { return false; }
  virtual void add_weights(const double* /*theta*/, Weights& /*weights*/) const {}

  /// What the effect makes of the compliance of each group of beams (ArmBending::groups, [1]): adds to `scale`.
  virtual void add_beam_scale(const double* /*theta*/, Eigen::VectorXd& /*scale*/) const {}

  /// Adds to `xi` ([m; rad], body frame) and appends the derivatives to `columns` unless null; parameters count from 0.
  virtual void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const = 0;
};

/// An effect linear in its parameters: xi = B(state) theta, so B is the Jacobian and cannot disagree with the model.
class LinearEffect : public Effect {
 public:
  /// Appends B, column by column.
  virtual void basis(const State& state, TwistColumns& columns) const = 0;

  /// The same of `rows` rows from `begin`, added part by part; false where an effect is asked row by row alone.
  virtual bool add_basis(const Samples& /*samples*/, Eigen::Index /*begin*/, int /*rows*/,
                         TwistTable& /*table*/) const {
    return false;
  }

  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const final {
    static thread_local TwistColumns own;  // its memory alone outlives the call
    own.clear();
    TwistColumns& to = columns != nullptr ? *columns : own;
    const std::size_t first = to.size();
    basis(state, to);
    for (std::size_t i = first; i < to.size(); ++i) xi.col(to[i].frame) += theta[to[i].parameter] * to[i].xi;
  }
};

}  // namespace fastcal
