// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A robot as a chain of elementary motions: DH, MDH, POE and URDF all end here, so that nothing behind this file knows
// which it was.
//
// The chain passes 2 n + 2 frames, in this order:  base, joint_1, link_1, joint_2, ..., joint_n, link_n (= flange),
// tool.
//   joint_i  moves with joint i, its z axis is the joint's axis;
//   link_i   is the far end of link i, where joint i + 1 is mounted (before that joint's motion); link_n is the flange.
// In each of them an error twist may act:  T_f = T_(f-1) * C_f * Z_f(q) * exp(xi_f),  Z the joint's motion along z
// (joint frames only). After P. Corke, J. Haviland, "Not your grandmother's toolbox" (2021): elementary transform
// sequences.
// Several robots, targets and instruments are joined to one tree of such chains (join): frames, joints and parameters
// of a branch lie together, as they do in the robot that it was.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fastcal/math/types.hpp"
#include "fastcal/robot/frame_tree.hpp"
#include "fastcal/robot/loop.hpp"

namespace fastcal {

class ArmBending;

enum class JointType { kRevolute, kPrismatic };

/// In whose axes the wrenches of the data are given; they act at the payload's centre.
enum class WrenchFrame { kBase, kFlange, kTool };

/// One rotation about or translation along an own axis.
enum class Motion { kTx, kTy, kTz, kRx, kRy, kRz };

/// A named number of the model, in SI.
struct Parameter {
  std::string owner;  ///< "base", "joint1", ..., "tool"
  std::string name;   ///< "theta", "d", "x", "rx", ...
  std::string unit;   ///< "rad", "m", ...: known to fastcal.units
  double sigma;       ///< a plausible size of its error: scales the solver, judges what data can't tell; no prior
  std::string doc;    ///< one line
  double lower = -std::numeric_limits<double>::infinity();  ///< what it can be at all
  double upper = std::numeric_limits<double>::infinity();
  double expected = 0;     ///< where a prior holds it: what the robot file says
  bool of_effect = false;  ///< of an effect, not of the geometry: ErrorModel marks them
  double hold = 0;         ///< how readily the gauge holds it; 0: by owner and name, fixing_priority()

  /// Owner and name; the unit where that says it all: "joint1 rad_k".
  std::string label() const { return owner + " " + (name.empty() ? unit : name); }
};

/// The rigid body that joint i moves.
struct Body {
  double mass = 0;                                ///< [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< [m], in the body's frame; half way along the link where neither
                                                  ///< it nor a mass is given
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< [kg m^2], about the com, axes of the body's frame
};

/// A spring that carries a part of the weight on a joint. Both points are in the joint's frame at joint position 0: the
/// anchor stays there with the link before the joint, the arm moves with the joint.
struct Compensator {
  int joint = 0;                                     ///< counts from 0
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();     ///< [m]
  double stiffness = 0;                              ///< [N/m]
  double free_length = 0;                            ///< [m]
};

/// Where what an arm carries acts on it.
struct Hand {
  Eigen::Vector3d p_flange_payload = Eigen::Vector3d::Zero();  ///< [m] where a payload's weight acts
  WrenchFrame wrench_frame = WrenchFrame::kBase;
};

/// What every kind of robot file has beside its geometry.
struct RobotDescription : Hand {
  std::vector<JointType> joint_types;
  std::vector<Body> bodies;                 ///< one a joint; mass 0 where the file gives none
  Pose T_world_base;                        ///< nominal, from the measuring frame
  Pose T_flange_tool;                       ///< nominal
  Eigen::Vector3d gravity{0, 0, -9.80665};  ///< [m/s^2], in base, or in the measuring frame:
  bool gravity_in_world = false;
  std::vector<Hand> hands;   ///< of each arm of a tree of several; empty: its own
  Eigen::MatrixXd coupling;  ///< (n, n) nominal c_ij: joint i turns by c_ij when joint j turns
  std::optional<Compensator> compensator;
  std::shared_ptr<const ArmBending> bending;  ///< the beams of the robot file; null: none
  Eigen::VectorXd motor_ratio;  ///< (n) turns of the motor per turn of the joint, NaN where unknown; or empty
  std::vector<int> parents;     ///< of an arm that branches: FrameTree; empty: one joint stands on the other
  std::vector<int> passive;     ///< joints, ascending, that the loops move
  std::vector<Loop> loops;
  Eigen::VectorXd home;  ///< (n) a posture in which the loops nearly close; where there are passive joints

  /// Of an arm, from 0.
  const Hand& hand(int arm) const { return hands.empty() ? *this : hands[static_cast<std::size_t>(arm)]; }
};

/// The chain (or tree) at given parameter values: what a batch loop needs, and nothing else.
struct Chain {
  /// d T_world_tool / d parameter is the twist `xi` (body) of frame `frame`, the same in every posture; base
  /// parameters: of kWorldFrame.
  struct Column {
    int parameter;
    int frame;
    Vector6d xi;
  };
  std::vector<JointType> joint_types;
  std::vector<Pose> constants;   ///< C_f, 2 n + 2
  std::vector<Column> columns;   ///< in the order of the chain; a parameter may have several
  std::vector<int> first_moved;  ///< of each column: the frame behind its own that it moves, with all that this carries
  std::vector<Pose> body_frames;  ///< pose of body i's frame in joint_i, n
  std::shared_ptr<const FrameTree> tree;
  std::vector<int> passive;                    ///< joints that the loops move
  std::vector<Loop> loops;                     ///< at these values
  std::vector<std::pair<int, int>> loop_rows;  ///< (loop, component) of the equations, one a passive joint
  Eigen::VectorXd home;                        ///< (n) where they close

  int joint_count() const { return static_cast<int>(joint_types.size()); }
  int frame_count() const { return static_cast<int>(constants.size()); }
  /// Columns of Twists and of loads: the frames, and behind them the loops, whose part kAlongRod is what effects make a
  /// rod longer, and its pull.
  int twist_count() const { return frame_count() + static_cast<int>(loops.size()); }
  int rod_twist(int loop) const { return frame_count() + loop; }
  bool is_serial() const { return tree->is_serial(); }
  bool has_loops() const { return !passive.empty(); }
};

class RobotModel;

/// What join() makes a branch of: a robot, or one frame, which has no robot.
struct Member {
  std::string name;  ///< owners and frames of a robot become "name.joint3", that of one frame is "name"
  std::shared_ptr<const RobotModel> robot;
  Pose T_on_frame;               ///< nominal, of one frame in the frame that it stands on
  std::string on = "world";      ///< the name of a frame in the tree: "left.link7", "camera"
  double sigma_position = 1e-3;  ///< [m], [rad]: plausible errors of where one frame stands
  double sigma_rotation = 1e-3;
};

/// The members as one tree. Gravity is that of the first robot on the world. Throws InvalidInput where a name is taken
/// twice, a member stands on nothing that there is or on itself, or a robot has beams.
RobotModel join(const std::vector<Member>& members);
constexpr double kShortestLink = 5e-3;  ///< [m] what is shorter is no beam, but what a calibration leaves of 0

/// Const once built. Parameter order: base (x, y, z, rx, ry, rz), the joints' rows, the loops' constants, tool (x, y,
/// z, rx, ry, rz).
class RobotModel {
 public:
  explicit RobotModel(RobotDescription description);

  // Building, in the order of the chain; called by the builders below only.
  void add_parameter(Motion motion, double value, Parameter parameter,
                     double sign = 1);                               ///< a new parameter and its motion
  void repeat_parameter(Motion motion, int parameter, double sign);  ///< the same parameter once more
  void add_constant(const Pose& pose);
  void add_joint();       ///< the next joint's motion along z
  void add_body_frame();  ///< here lies the frame in which the last joint's body is given
  void add_link_end();    ///< the far end of the last joint's link
  /// Before the motions of a joint: where it stands on another link than that before, it goes on from there, the last
  /// joint's link ending here where `ends_link` says so.
  void open_branch(int joint, bool ends_link);
  bool follows(int joint) const { return tree_->follows(joint); }  ///< does it stand on the link before, alone?
  void set_link_axis(int joint, const Eigen::Vector3d& axis);      ///< see link_axis
  void finish();  ///< flange to tool; checks that the chain is complete

  int joint_count() const { return static_cast<int>(description_.joint_types.size()); }
  int frame_count() const { return tree_->frame_count(); }
  const FrameTree& tree() const { return *tree_; }
  /// The frame that readings are of where they name none: the tool of the first branch that is a robot.
  View view() const { return {tool_, kWorldFrame}; }
  const RobotDescription& description() const { return description_; }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  const Eigen::VectorXd& nominal() const { return nominal_; }

  /// The chain at `values` (same order and size as parameters()).
  Chain chain(const Eigen::Ref<const Eigen::VectorXd>& values) const;
  Chain chain() const { return chain(nominal_); }

  /// The link as a beam: the vector [m] along its own axis from root to far end, in the axes of joint_i. DH: a_i along
  /// x, MDH: the a of row i + 1, where these are 0 (or what a calibration leaves of it) the d of the link along z; POE
  /// and URDF: from the joint's origin to the next joint's. 0 where that is shorter than kShortestLink.
  Eigen::Vector3d link_axis(int joint) const;

  /// Name of a frame: "base", "joint2", "link2", "tool".
  const std::string& frame_name(int frame) const { return tree_->name(frame); }

  /// The same robot, its base and tool rotations measured from new references: rx, ry, rz of both are 0 there.
  /// Base and tool positions become the given ones. Keeps the solver far from the singularity of three angles.
  RobotModel with_base_and_tool(const Pose& T_world_base, const Pose& T_flange_tool) const;

 private:
  friend RobotModel join(const std::vector<Member>& members);
  enum class StepKind { kMotion, kConstant, kJoint, kBodyFrame, kFrame, kBaseReference, kToolReference, kBranch };
  struct Step {
    StepKind kind;
    Motion motion = Motion::kTx;
    int parameter = -1;
    double sign = 1;
    Pose constant;
  };
  void add_frame_parameters(const std::string& owner, const Pose& pose, StepKind reference);
  void add_number(double value, Parameter parameter);  ///< a parameter that moves no frame by itself
  void add_loop_parameters();
  void close_loops();
  Loop loop_at(const Loop& loop, const Eigen::Ref<const Eigen::VectorXd>& values) const;

  RobotDescription description_;
  std::vector<Step> steps_;
  std::vector<Parameter> parameters_;
  Eigen::VectorXd nominal_;
  std::vector<Eigen::Vector3d> link_axes_;
  int joints_added_ = 0;
  std::shared_ptr<const FrameTree> tree_;
  int tool_ = 0;
  std::vector<std::pair<int, int>> loop_rows_;  // see Chain
};

/// Classic DH: T_i = Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta); rows (n, 5): theta, d, a, alpha, beta in rad and m.
RobotModel build_dh(RobotDescription description, const RowMatrixXd& rows);

/// Modified DH (Craig): T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta); row i holds alpha_(i-1), a_(i-1). Columns
/// as build_dh.
RobotModel build_mdh(RobotDescription description, const RowMatrixXd& rows);

/// Products of exponentials: T = exp(S_1 (q_1 + o_1)) ... exp(S_n (q_n + o_n)) home; screws (n, 7): omega (unit, or 0
/// for prismatic), v = -omega x point (or the unit direction), offset o; base frame, q = 0 (SR210D, equations 1 and 2).
/// An axis' error is four numbers, tilt (rx, ry) and shift (x, y) across it, where equation 20 has six of which two do
/// nothing.
RobotModel build_poe(RobotDescription description, const RowMatrixXd& screws, const Pose& home);

/// URDF: joint i is mounted at origins[i] in the frame of joint i - 1 and moves about or along axes (n, 3, unit) there.
/// `flange` is what is fixed behind the last joint. An origin's error is six numbers: x, y, z, rx, ry, rz in its own
/// frame.
RobotModel build_urdf(RobotDescription description, const std::vector<Pose>& origins, const RowMatrixXd& axes,
                      const Pose& flange);

/// A rotation whose z axis is `axis` (unit): the least turn from z; within 26 degrees of -z, where the least turn has
/// no limit, a half turn about x and the least turn from there, so that a slightly tilted axis gets a slightly turned
/// frame.
Eigen::Matrix3d rotation_to_axis(const Eigen::Vector3d& axis);

}  // namespace fastcal
