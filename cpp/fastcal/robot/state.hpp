// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The state of a robot in one measured posture, and the table of all of them. A State depends on the row and on the
// model at the start of an outer iteration, never on the parameters inside a solve: effects stay linear, and threads
// share nothing that changes.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "fastcal/math/types.hpp"
#include "fastcal/robot/joint_rows.hpp"
#include "fastcal/robot/robot_model.hpp"

namespace fastcal {

/// What identified weights and springs add to those of the robot file.
struct Weights {
  Eigen::VectorXd mass;     ///< (n) of the links [kg]
  Eigen::Matrix3Xd moment;  ///< (3, n) mass times shift of the centre [kg m], frames of the bodies
  double payload_mass = 0;  ///< [kg], in rows that carry one
  Eigen::Vector3d payload_shift = Eigen::Vector3d::Zero();  ///< [m], flange
  double spring_scale = 0;                                  ///< share by which the compensator is stiffer

  explicit Weights(int joint_count = 0)
      : mass(Eigen::VectorXd::Zero(joint_count)), moment(Eigen::Matrix3Xd::Zero(3, joint_count)) {}
};

struct Samples;

/// What one effect may look at. Null or NaN: not given in the data. SI. Conditions are those of one arm; of a tree of
/// several of its first, and of_arm() has the others'.
struct State {
  const double* q = nullptr;  ///< n joint positions as commanded [rad, m]
  double payload = 0;         ///< [kg]
  const double* wrench =
      nullptr;  ///< fx fy fz mx my mz at the payload's centre [N, N m], in the axes of the robot's wrench frame
  double temperature = std::numeric_limits<double>::quiet_NaN();  ///< [K]
  double time = std::numeric_limits<double>::quiet_NaN();         ///< [s]
  int station = -1;
  int mount = -1;
  const double* approach = nullptr;  ///< n of +1, -1, or 0 where unknown
  const double* current = nullptr;   ///< n motor currents [A]
  const double* extra = nullptr;     ///< columns of the user's own
  const double* table = nullptr;     ///< basis values of effects that a user registered
  const Samples* samples = nullptr;  ///< whose row it is; null: of none
  Eigen::Index index = 0;            ///< among these

  // What the model itself makes of the row, at the start of an outer iteration (model/settle.hpp); null where no effect
  // asked for it.
  const Chain* chain = nullptr;     ///< the geometry as far as it is identified, no effect in it
  const Pose* frames = nullptr;     ///< T_world_frame of the deflected arm, one a frame
  const double* gravity = nullptr;  ///< [m/s^2] in the measuring frame
  /// 6 a frame: force and moment that all beyond puts on the frame, its axes, its origin [N, N m]; then 6 a loop, of
  /// which kAlongRod is a rod's pull [N].
  const double* load = nullptr;
  const double* payload_load = nullptr;  ///< the payload's and the wrench's share of `load`
  const double* output = nullptr;        ///< n joint positions behind the gears: q with the identified reduction ratios
  const double* compliance = nullptr;    ///< n slopes d q / d torque of all compliances of the joint [rad/(N m), m/N]
  const Weights* weights = nullptr;      ///< what `load` holds beyond the weights of the robot file
  double spring = 0;                     ///< the nominal compensator's share of its joint's load [N m, N]
  const double* bending = nullptr;       ///< (frames, groups, 6) twists by compliance of the beams: arm_bending.hpp

  /// Load about (revolute) or along (prismatic) the axis of a joint, which is z of its frame.
  double joint_load(const double* loads, int joint, JointType type) const {
    return loads[6 * joint_frame(joint) + (type == JointType::kRevolute ? 5 : 2)];
  }

  /// The same posture with the payload, temperature, wrench, station and mount of an arm of the tree, from 0.
  State of_arm(int arm) const;
};

/// N rows of conditions; what is empty was not measured. `q` is required. Of a tree of a arms what each of them carries
/// and knows stands side by side, as their joints do.
struct Samples {
  JointRows q;                       ///< (N, n)
  RowMatrixXd payload, temperature;  ///< (N, a)
  RowMatrixXd wrench;                ///< (N, 6 a)
  RowMatrixXi station, mount;        ///< (N, a)
  Eigen::VectorXd time;              ///< (N)
  RowMatrixXd approach, current;     ///< (N, n)
  RowMatrixXd extra;                 ///< (N, k)
  RowMatrixXd table;                 ///< (N, k) basis values of effects that a user registered

  // Filled by settle().
  std::shared_ptr<const Chain> chain;
  std::vector<Pose> frames;  ///< N x frames
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  RowMatrixXd load, payload_load;  ///< (N, 6 Chain::twist_count())
  RowMatrixXd output, compliance;  ///< (N, n)
  Weights weights;
  Eigen::VectorXd spring;  ///< (N)
  RowMatrixXd bending;     ///< (N, ArmBending::width())

  Eigen::Index count() const { return q.rows(); }

  /// Rows begin ... end - 1, without what settle() fills.
  Samples slice(Eigen::Index begin, Eigen::Index end) const;
  /// Some rows, with what settle() filled.
  Samples pick(const std::vector<Eigen::Index>& rows) const;

  /// Throws InvalidInput where a table does not fit q or the tree, or a joint position is not finite.
  void check(const FrameTree& tree) const {
    check_shapes(tree);
    check_finite(0, count());
  }
  /// The two halves of check(): what the tables are, and what rows begin ... end - 1 hold.
  void check_shapes(const FrameTree& tree) const;
  void check_finite(Eigen::Index begin, Eigen::Index end) const;

  State row(Eigen::Index i) const {
    State s;
    s.q = q.row(i);
    s.samples = this;
    s.index = i;
    take(s, 0);
    if (time.size() > 0) s.time = time[i];
    if (approach.size() > 0) s.approach = approach.row(i).data();
    if (current.size() > 0) s.current = current.row(i).data();
    if (extra.size() > 0) s.extra = extra.row(i).data();
    if (table.size() > 0) s.table = table.row(i).data();
    if (!frames.empty()) {
      s.chain = chain.get();
      s.frames = frames.data() + i * static_cast<Eigen::Index>(frames.size()) / q.rows();
      s.gravity = gravity.data();
    }
    if (load.size() > 0) {
      s.load = load.row(i).data();
      s.weights = &weights;
      s.spring = spring[i];
    }
    if (payload_load.size() > 0) s.payload_load = payload_load.row(i).data();
    if (output.size() > 0) s.output = output.row(i).data();
    if (compliance.size() > 0) s.compliance = compliance.row(i).data();
    if (bending.size() > 0) s.bending = bending.row(i).data();
    return s;
  }

  /// Puts an arm's conditions of its row into `s`.
  void take(State& s, int arm) const {
    if (payload.size() > 0) s.payload = payload(s.index, arm);
    if (wrench.size() > 0) s.wrench = wrench.row(s.index).data() + Eigen::Index{6} * arm;
    if (temperature.size() > 0) s.temperature = temperature(s.index, arm);
    if (station.size() > 0) s.station = station(s.index, arm);
    if (mount.size() > 0) s.mount = mount(s.index, arm);
  }
};

inline State State::of_arm(int arm) const {
  State out = *this;
  if (samples != nullptr) samples->take(out, arm);
  return out;
}

/// The postures of a tree's arms, in its order, as postures of the tree. What an arm does not know is 0 of payloads,
/// wrenches and approaches, -1 of labels, NaN of the rest; the columns in `extra` and `table` follow each other. `time`
/// is that of the first arm that has one. Throws InvalidInput where there is no arm or the counts of rows differ.
Samples side_by_side(const std::vector<Samples>& arms);

}  // namespace fastcal
