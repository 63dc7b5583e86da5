// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The contract of an observation: what one instrument reads, row by row, and what it should read of an arm that is
// somewhere. The model alone knows how parameters move the frames of the chain, the observation alone how the frames
// and its own unknowns (where an anchor is, how a plane lies) make its numbers; no observation knows that another
// exists. Every observation obeys: residuals are predicted less measured; derivatives are exact; const and stateless;
// NaN in a table means not measured in that row.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "fastcal/math/types.hpp"
#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

constexpr int kMostComponents = 3;  ///< numbers of one reading
constexpr int kMostFrames = 4;      ///< frames of the chain that it may look at
constexpr int kMostUnknowns = 32;   ///< own unknowns on which one reading may depend

/// One reading of an observation. Filled again for each.
struct Comparison {
  std::array<bool, kMostComponents> present{};  ///< was it measured?
  Eigen::Vector3d r;                            ///< predicted less measured
  /// d r / d [v; w] of each frame it looks at: motion of the frame's origin, axes of the measuring frame.
  std::array<Eigen::Matrix<double, kMostComponents, 6>, kMostFrames> by_frame;
  int first_unknown = 0;  ///< of parameters(): this row depends on unknown_count from here on
  int unknown_count = 0;
  int second_unknown = 0;  ///< and on second_count from here on, whose derivatives follow those of the first
  int second_count = 0;
  Eigen::Matrix<double, kMostComponents, kMostUnknowns> by_unknown;  ///< d r / d unknown

  /// As new, for an observation of so many frames, with unknowns or without.
  void clear(std::size_t frames = kMostFrames, bool unknowns = true) {
    present.fill(false);
    r.setZero();
    for (std::size_t f = 0; f < frames; ++f) by_frame[f].setZero();
    first_unknown = unknown_count = second_unknown = second_count = 0;
    if (unknowns) by_unknown.setZero();
  }
};

/// What a row measures of the tool's pose directly, for the closed-form start of base and tool.
struct MeasuredPose {
  Eigen::Vector3d p_world_tool = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_world_tool = Eigen::Matrix3d::Identity();
  bool has_point = false;
  bool has_rotation = false;
};

/// Poses in the measuring frame of the frames that an observation looks at, in the order of frames().
using Sights = std::array<Pose, kMostFrames>;

class Observation {
 public:
  Observation() = default;
  Observation(const Observation&) = delete;
  Observation& operator=(const Observation&) = delete;
  virtual ~Observation() = default;

  /// What it reads, for messages and reports: "position", "tilt of link3".
  virtual std::string name() const = 0;

  /// The numbers of a reading, one name each: "x", "y", "z"; at most kMostComponents.
  virtual const std::vector<std::string>& components() const = 0;

  /// The field of a data set that its numbers are of; empty: there is none, as for the height over a plane.
  virtual std::string field() const { return ""; }

  /// Of the residuals and their standard deviations: "m", "rad" or "px".
  virtual std::string unit() const = 0;

  /// Frames of the chain that it looks at, at most kMostFrames.
  virtual std::vector<int> frames() const = 0;

  /// Unknowns of its own, identified with every fit. `sigma` is a plausible size, `owner` names the thing: "anchor 2".
  virtual const std::vector<Parameter>& parameters() const;

  /// Residual and derivatives of a row; `out` is clear. `unknowns` are the values of parameters().
  virtual void compare(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out) const = 0;

  /// Readings of a row, each of as many numbers: one, but of a picture as many as a board has corners.
  virtual int reading_count() const { return 1; }

  /// compare() of one of the readings of a row.
  virtual void compare_reading(Eigen::Index row, int /*reading*/, const Sights& sights, const double* unknowns,
                               Comparison& out) const {
    compare(row, sights, unknowns, out);
  }

  /// compare_reading() of all readings of a row, each into a clear `out`: `take`, which clears it again, is told which.
  /// Worth writing where readings share much, as the corners of a picture do.
  virtual void compare_all(Eigen::Index row, const Sights& sights, const double* unknowns, Comparison& out,
                           const std::function<void(int)>& take) const {
    for (int reading = 0; reading < reading_count(); ++reading) {
      compare_reading(row, reading, sights, unknowns, out);
      take(reading);
    }
  }

  /// Standard deviation that the data claim for a number of a row; 0: they claim none.
  virtual double sigma(Eigen::Index row, int number) const = 0;
  virtual bool claims_sigma() const = 0;
  /// Is it known beforehand and was not read? What is claimed is then all of its noise.
  virtual bool is_known() const { return false; }

  /// Values of the unknowns (sized already) in closed form, for an arm as `sights` (one a row) have it. Returns
  /// what is missing, in a sentence; empty: nothing.
  virtual std::string start(const std::vector<Sights>& sights, Eigen::Ref<Eigen::VectorXd> unknowns) const;

  /// Other values of the unknowns with which all rows would read nearly the same of an arm that is as `sights` say,
  /// however far away they are; false: there are none. An identification fits both.
  virtual bool mirror(const std::vector<Sights>& /*sights*/, Eigen::Ref<Eigen::VectorXd> /*unknowns*/) const {
    return false;
  }

  /// Does it show where the base is (not what has its own place unknown on the base)? The tool, and its turn?
  virtual bool shows_base() const = 0;
  virtual bool shows_tool() const { return true; }
  virtual bool shows_tool_turn() const { return false; }
  /// Does it show how long links are? Turns do not, nor do touches of unknown points: an arm of no size has no errors.
  virtual bool shows_scale() const { return true; }

  /// Is it a part of the tool's pose? Then add_pose adds what a row measures of it.
  virtual bool is_pose() const { return false; }
  virtual void add_pose(Eigen::Index /*row*/, MeasuredPose& /*pose*/) const {}

  /// (N, 3) where r is the tool's position less this table: the kernels then need no slopes. Null otherwise.
  virtual const RowMatrixXd* coordinates() const { return nullptr; }
};

}  // namespace fastcal
