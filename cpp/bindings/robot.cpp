// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include <algorithm>

#include "convert.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/robot/arm_bending.hpp"
#include "fastcal/robot/assembly.hpp"
#include "fastcal/robot/kinematics.hpp"
#include "fastcal/robot/robot_model.hpp"
#include "fastcal/robot/tables_with_flange.hpp"
#include "fastcal/robot/urdf.hpp"

namespace fastcal {
namespace {

JointType joint_type(const std::string& name) {
  if (name == "revolute") return JointType::kRevolute;
  FASTCAL_CHECK(name == "prismatic") << "a joint must be revolute or prismatic, got '" << name << "'";
  return JointType::kPrismatic;
}

RobotDescription describe(const std::vector<std::string>& joint_types, const Eigen::VectorXd& mass,
                          const RowMatrixXd& com, const RowMatrixXd& inertia, const Eigen::Matrix4d& T_world_base,
                          const Eigen::Matrix4d& T_flange_tool, const Eigen::Vector3d& p_flange_payload,
                          const Eigen::Vector3d& gravity, bool gravity_in_world, const Eigen::MatrixXd& coupling,
                          const std::string& wrench_frame, const std::optional<Compensator>& compensator,
                          const Eigen::VectorXd& motor_ratio, const std::optional<std::shared_ptr<ArmBending>>& bending,
                          const std::vector<int>& parents, const std::vector<int>& passive,
                          const std::vector<Loop>& loops, const Eigen::VectorXd& home) {
  RobotDescription out;
  const auto n = static_cast<Eigen::Index>(joint_types.size());
  FASTCAL_CHECK(mass.size() == n && com.rows() == n && com.cols() == 3 && inertia.rows() == n && inertia.cols() == 6)
      << "mass, com and inertia must have shapes (n,), (n, 3), (n, 6) for n = " << n << " joints";
  for (Eigen::Index i = 0; i < n; ++i) {
    out.joint_types.push_back(joint_type(joint_types[static_cast<std::size_t>(i)]));
    Body body;
    body.mass = mass[i];
    body.com = com.row(i);
    const auto I = inertia.row(i);
    body.inertia << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
    out.bodies.push_back(body);
  }
  out.T_world_base = to_pose(T_world_base);
  out.T_flange_tool = to_pose(T_flange_tool);
  out.p_flange_payload = p_flange_payload;
  out.gravity = gravity;
  out.gravity_in_world = gravity_in_world;
  out.coupling = coupling;
  out.wrench_frame = wrench_frame == "flange" ? WrenchFrame::kFlange
                     : wrench_frame == "tool" ? WrenchFrame::kTool
                                              : WrenchFrame::kBase;
  FASTCAL_CHECK(!compensator || (compensator->joint >= 0 && compensator->joint < n))
      << "the compensator's joint must be 0 to " << n - 1;
  out.compensator = compensator;
  FASTCAL_CHECK(motor_ratio.size() == 0 || motor_ratio.size() == n)
      << "motor_ratio must have shape (" << n << ",), got (" << motor_ratio.size() << ",)";
  out.motor_ratio = motor_ratio;
  out.bending = bending.value_or(nullptr);
  out.parents = parents;
  const auto is_joint = [n](int joint) { return joint >= 0 && joint < n; };
  FASTCAL_CHECK(std::is_sorted(passive.begin(), passive.end()) && std::all_of(passive.begin(), passive.end(), is_joint))
      << "passive joints must be 0 to " << n - 1 << " in ascending order";
  out.passive = passive;
  FASTCAL_CHECK(home.size() == 0 || home.size() == n)
      << "home must have shape (" << n << ",), got (" << home.size() << ",)";
  out.home = home;
  for (const Loop& loop : loops) {
    const auto is_frame = [n](int frame) { return frame >= 0 && frame <= 2 * n + 1; };
    FASTCAL_CHECK(loop.kind == Loop::Kind::kGear ? is_joint(loop.driven)
                                                 : is_frame(loop.frames.target) && is_frame(loop.frames.sensor))
        << "loop '" << loop.name << "' must join frames 0 to " << 2 * n + 1 << " or joints 0 to " << n - 1;
    for (const auto& joint : loop.joints)
      FASTCAL_CHECK(is_joint(joint.first)) << "loop '" << loop.name << "' names joints of the arm, 0 to " << n - 1;
    out.loops.push_back(loop);
  }
  return out;
}

py::dict chain_dict(const UrdfChain& chain) {
  py::list joints;
  for (const UrdfJoint& joint : chain.joints) {
    const Eigen::Matrix3d& I = joint.body.inertia;
    py::object mimic = py::none();
    if (joint.mimic)
      mimic = py::dict(py::arg("driver") = joint.mimic->driver, py::arg("multiplier") = joint.mimic->multiplier,
                       py::arg("offset") = joint.mimic->offset);
    joints.append(py::dict(
        py::arg("name") = joint.name, py::arg("type") = joint.type == JointType::kRevolute ? "revolute" : "prismatic",
        py::arg("mimic") = mimic, py::arg("mount") = from_pose(joint.mount),
        py::arg("origin") = from_pose(joint.origin), py::arg("axis") = joint.axis, py::arg("lower") = joint.lower,
        py::arg("upper") = joint.upper, py::arg("mass") = joint.body.mass, py::arg("com") = joint.body.com,
        py::arg("inertia") = std::vector<double>{I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)}));
  }
  return py::dict(py::arg("name") = chain.name, py::arg("base_link") = chain.base_link,
                  py::arg("tip_link") = chain.tip_link, py::arg("joints") = joints,
                  py::arg("flange") = from_pose(chain.flange), py::arg("notes") = chain.notes);
}

py::list branch_list(const std::string& xml, const std::string& base_link, const std::vector<std::string>& tip_links) {
  py::list out;
  for (const UrdfBranch& branch : read_urdf_tree(xml, base_link, tip_links))
    out.append(py::make_tuple(branch.parent, chain_dict(branch.chain)));
  return out;
}

void bind_loops(py::module_& m) {
  py::class_<Loop>(m, "Loop", "What closes a loop of an arm: equations between two frames or between joints; SI.")
      .def_static(
          "pose",
          [](const std::string& name, int from, int to, const Eigen::Matrix4d& T_from_pin,
             const Eigen::Matrix4d& T_to_pin, const std::vector<int>& fixed, bool knows_from, bool knows_to) {
            FASTCAL_CHECK(!fixed.empty() && std::is_sorted(fixed.begin(), fixed.end()) && fixed.front() >= 0 &&
                          fixed.back() < 6)
                << "loop '" << name << "' fixes components 0 to 5 in ascending order";
            Loop out;
            out.name = name;
            out.frames = {to, from};
            out.from = to_pose(T_from_pin);
            out.to = to_pose(T_to_pin);
            out.fixed = fixed;
            out.knows_from = knows_from;
            out.knows_to = knows_to;
            return out;
          },
          py::kw_only(), py::arg("name"), py::arg("from_frame"), py::arg("to_frame"), py::arg("T_from_pin"),
          py::arg("T_to_pin"), py::arg("fixed"), py::arg("knows_from"), py::arg("knows_to"),
          "Components (0 to 5: x y z rx ry rz) of the pose of one pin seen from another are 0; knows_from, knows_to: "
          "the "
          "pin's place is a parameter.")
      .def_static(
          "rod",
          [](const std::string& name, int from, int to, const Eigen::Vector3d& p_from, const Eigen::Vector3d& p_to,
             double length, const std::vector<std::pair<int, double>>& joints) {
            Loop out;
            out.name = name;
            out.kind = Loop::Kind::kRod;
            out.frames = {to, from};
            out.from.p = p_from;
            out.to.p = p_to;
            out.length = length;
            out.joints = joints;
            return out;
          },
          py::kw_only(), py::arg("name"), py::arg("from_frame"), py::arg("to_frame"), py::arg("p_from"),
          py::arg("p_to"), py::arg("length"), py::arg("joints") = std::vector<std::pair<int, double>>(),
          "The distance [m] of two pins; joints (joint, m per m or rad) add to it.")
      .def_static(
          "gear",
          [](const std::string& name, int driven, const std::vector<std::pair<int, double>>& joints, double offset) {
            Loop out;
            out.name = name;
            out.kind = Loop::Kind::kGear;
            out.driven = driven;
            out.joints = joints;
            out.length = offset;
            return out;
          },
          py::kw_only(), py::arg("name"), py::arg("driven"), py::arg("joints"), py::arg("offset"),
          "A joint turns by the sum of ratios times others' turns, and an offset [rad, m].")
      .def_readonly("name", &Loop::name);
}

py::tuple assemble(const RobotModel& self, const RowMatrixXd& q, int threads) {
  FASTCAL_CHECK(q.cols() == self.joint_count())
      << "q must have shape (N, " << self.joint_count() << "), got (" << q.rows() << ", " << q.cols() << ")";
  RowMatrixXd out = q;
  Eigen::VectorXi status = Eigen::VectorXi::Zero(q.rows());
  Eigen::VectorXd gap = Eigen::VectorXd::Zero(q.rows());
  std::vector<std::string> widest(static_cast<std::size_t>(q.rows()));
  const Chain chain = self.chain();
  if (chain.has_loops()) {
    const py::gil_scoped_release release;
    parallel_chunks(q.rows(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
      Assembler assembler(chain);
      for (Eigen::Index i = begin; i < end; ++i) {
        for (const int joint : chain.passive) out(i, joint) = chain.home[joint];
        status[i] = static_cast<int>(assembler.assemble(out.row(i).data()));
        gap[i] = assembler.gap();
        const int loop = chain.loop_rows[static_cast<std::size_t>(assembler.widest())].first;
        widest[static_cast<std::size_t>(i)] = chain.loops[static_cast<std::size_t>(loop)].name;
      }
    });
  }
  return py::make_tuple(out, status, gap, widest);
}

}  // namespace

void bind_robot(py::module_& m) {
  py::class_<Parameter>(m, "Parameter", "A named number of a model, in SI.")
      .def_readonly("owner", &Parameter::owner)
      .def_readonly("name", &Parameter::name)
      .def_readonly("unit", &Parameter::unit)
      .def_readonly("sigma", &Parameter::sigma, "a plausible size of its error")
      .def_readonly("lower", &Parameter::lower, "what it can be at all")
      .def_readonly("upper", &Parameter::upper)
      .def_readonly("expected", &Parameter::expected, "where a prior holds it")
      .def("__repr__", [](const Parameter& p) { return "<Parameter " + p.label() + " [" + p.unit + "]>"; });

  py::class_<Compensator>(m, "Compensator",
                          "A spring on a joint; anchor and arm [m] in the joint's frame at joint position 0.")
      .def(py::init([](int joint, const Eigen::Vector3d& anchor, const Eigen::Vector3d& arm, double stiffness,
                       double free_length) {
             return Compensator{joint, anchor, arm, stiffness, free_length};
           }),
           py::kw_only(), py::arg("joint"), py::arg("anchor"), py::arg("arm"), py::arg("stiffness"),
           py::arg("free_length"));

  py::class_<ArmBending, std::shared_ptr<ArmBending>>(m, "ArmBending", "How an arm's beams bend.")
      .def_property_readonly("groups", &ArmBending::groups, "Names of the groups of elements.")
      .def_property_readonly("frames", &ArmBending::frames, "Frames of the chain that the beams move.");

  bind_loops(m);

  py::class_<RobotDescription>(m, "RobotDescription", "What every kind of robot file has beside its geometry; SI.")
      .def(py::init(&describe), py::kw_only(), py::arg("joint_types"), py::arg("mass"), py::arg("com"),
           py::arg("inertia"), py::arg("T_world_base"), py::arg("T_flange_tool"), py::arg("p_flange_payload"),
           py::arg("gravity"), py::arg("gravity_in_world"), py::arg("coupling"), py::arg("wrench_frame"),
           py::arg("compensator") = py::none(), py::arg("motor_ratio") = Eigen::VectorXd(),
           py::arg("bending") = py::none(), py::arg("parents") = std::vector<int>(),
           py::arg("passive") = std::vector<int>(), py::arg("loops") = std::vector<Loop>(),
           py::arg("home") = Eigen::VectorXd(),
           "parents: of each joint the one on whose link it stands (-1: the base), empty: the one before; home (n,): "
           "where the loops nearly close. "
           "joint_types (n) 'revolute' or 'prismatic'; mass (n,), com (n, 3), inertia (n, 6) as xx yy zz xy xz yz; "
           "poses (4, 4); coupling (n, n).");

  py::class_<Branch>(m, "Branch", "A run of frames, joints and parameters of a robot: an arm, or one frame alone.")
      .def_readonly("name", &Branch::name, "empty where it is the whole robot")
      .def_readonly("parent", &Branch::parent, "the frame that its first one stands on; -1: the measuring frame")
      .def_readonly("first_frame", &Branch::first_frame)
      .def_readonly("frame_count", &Branch::frame_count)
      .def_readonly("first_joint", &Branch::first_joint)
      .def_readonly("joint_count", &Branch::joint_count)
      .def_readonly("first_parameter", &Branch::first_parameter)
      .def_readonly("parameter_count", &Branch::parameter_count)
      .def("__repr__",
           [](const Branch& b) { return "<Branch " + b.name + ", " + std::to_string(b.frame_count) + ">"; });

  py::class_<RobotModel, std::shared_ptr<RobotModel>>(m, "RobotModel",
                                                      "A robot as a chain of elementary motions, or a tree; const.")
      .def_property_readonly("joint_count", &RobotModel::joint_count)
      .def_property_readonly("frame_count", &RobotModel::frame_count)
      .def_property_readonly("parameters", &RobotModel::parameters)
      .def_property_readonly("nominal", &RobotModel::nominal, "Values of the parameters (P,), SI.")
      .def("frame_name", &RobotModel::frame_name, py::arg("frame"))
      .def(
          "frame", [](const RobotModel& self, const std::string& name) { return self.tree().frame(name); },
          py::arg("name"), "The frame of this name; -1: 'world'.")
      .def_property_readonly(
          "parents",
          [](const RobotModel& self) {
            std::vector<int> out;
            for (int f = 0; f < self.frame_count(); ++f) out.push_back(self.tree().parent(f));
            return out;
          },
          "Of each frame, in depth-first order; -1: the measuring frame.")
      .def_property_readonly("branches", [](const RobotModel& self) { return self.tree().branches(); })
      .def(
          "placements",
          [](const RobotModel& self, const Eigen::VectorXd& values) {
            const Chain chain = self.chain(values);
            std::vector<Eigen::Matrix4d> out;
            for (const Branch& branch : self.tree().branches())
              out.push_back(from_pose(chain.constants[static_cast<std::size_t>(branch.first_frame)]));
            return out;
          },
          py::arg("values"), "Where each branch stands on its frame (4, 4), at parameter values (P,).")
      .def(
          "frame_origins",
          [](const RobotModel& self, const RowMatrixXd& q) {
            FASTCAL_CHECK(q.cols() == self.joint_count())
                << "q must have shape (N, " << self.joint_count() << "), got (" << q.rows() << ", " << q.cols() << ")";
            const Eigen::Index count = self.frame_count();
            py::array_t<double> out({q.rows(), count, Eigen::Index{3}});
            Eigen::Map<RowMatrixXd> origins(out.mutable_data(), q.rows() * count, 3);
            std::vector<Pose> frames;
            for (Eigen::Index i = 0; i < q.rows(); ++i) {
              forward(self.chain(), q.row(i).data(), nullptr, frames);
              for (Eigen::Index f = 0; f < count; ++f)
                origins.row(i * count + f) = frames[static_cast<std::size_t>(f)].p;
            }
            return out;
          },
          py::arg("q"),
          "Origins (N, frames, 3) of the chain's frames in the measuring frame, at joint positions (N, n).")
      .def_property_readonly(
          "passive", [](const RobotModel& self) { return self.description().passive; },
          "Joints, from 0, that closed loops move and no motor.")
      .def_property_readonly(
          "home", [](const RobotModel& self) { return self.description().home; },
          "A posture (n,) in which the loops close; empty without loops.")
      .def("assemble", &assemble, py::arg("q"), py::arg("threads") = 1,
           "Joint positions (N, n) with the passive joints where the loops close; statuses (N,): 0 closed, 1 singular, "
           "2 "
           "another way of assembly, 3 open; the widest gap (N,) [m, rad] and (N,) the loop that has it.")
      .def(
          "with_base_and_tool",
          [](const RobotModel& self, const Eigen::Matrix4d& base, const Eigen::Matrix4d& tool) {
            return self.with_base_and_tool(to_pose(base), to_pose(tool));
          },
          py::arg("T_world_base"), py::arg("T_flange_tool"),
          "The same robot with base and tool (4, 4) there; their rx, ry, rz are measured from there.")
      .def(
          "base_and_tool",
          [](const RobotModel& self, const Eigen::VectorXd& values) {
            const Chain chain = self.chain(values);
            return std::make_pair(from_pose(chain.constants[kBaseFrame]), from_pose(chain.constants.back()));
          },
          py::arg("values"), "T_world_base and T_flange_tool (4, 4) at parameter values (P,).");

  m.def(
      "build_dh",
      [](const RobotDescription& d, const RowMatrixXd& rows, const Eigen::Matrix4d& flange) {
        return build_dh(d, rows, to_pose(flange));
      },
      py::arg("description"), py::arg("rows"), py::arg("flange") = Eigen::Matrix4d(Eigen::Matrix4d::Identity()),
      "Classic DH; rows (n, 5): theta, d, a, alpha, beta in rad and m; flange (4, 4) in the last row's frame.");
  m.def(
      "build_mdh",
      [](const RobotDescription& d, const RowMatrixXd& rows, const Eigen::Matrix4d& flange) {
        return build_mdh(d, rows, to_pose(flange));
      },
      py::arg("description"), py::arg("rows"), py::arg("flange") = Eigen::Matrix4d(Eigen::Matrix4d::Identity()),
      "Modified DH (Craig); row i holds alpha_(i-1), a_(i-1); columns and flange as build_dh.");
  m.def(
      "build_poe",
      [](const RobotDescription& d, const RowMatrixXd& screws, const Eigen::Matrix4d& home) {
        return build_poe(d, screws, to_pose(home));
      },
      py::arg("description"), py::arg("screws"), py::arg("home"),
      "Products of exponentials; screws (n, 7): omega, v, offset in the base frame; home (4, 4).");
  m.def(
      "build_urdf",
      [](const RobotDescription& d, const std::vector<Eigen::Matrix4d>& origins, const RowMatrixXd& axes,
         const Eigen::Matrix4d& flange) {
        std::vector<Pose> poses;
        for (const Eigen::Matrix4d& T : origins) poses.push_back(to_pose(T));
        return build_urdf(d, poses, axes, to_pose(flange));
      },
      py::arg("description"), py::arg("origins"), py::arg("axes"), py::arg("flange"),
      "URDF chain; origins n of (4, 4), axes (n, 3), flange (4, 4).");
  m.def("rotation_to_axis", &rotation_to_axis, py::arg("axis"), "A rotation (3, 3) whose z axis is `axis` (unit).");
  py::class_<Member>(m, "Member", "What join() makes a branch of: a robot, or one frame, which has none.")
      .def(py::init([](const std::string& name, const std::string& on,
                       const std::optional<std::shared_ptr<RobotModel>>& robot, const Eigen::Matrix4d& T_on_frame,
                       double sigma_position, double sigma_rotation) {
             return Member{name, robot.value_or(nullptr), to_pose(T_on_frame), on, sigma_position, sigma_rotation};
           }),
           py::kw_only(), py::arg("name"), py::arg("on") = "world", py::arg("robot") = py::none(),
           py::arg("T_on_frame") = Eigen::Matrix4d(Eigen::Matrix4d::Identity()), py::arg("sigma_position") = 1e-3,
           py::arg("sigma_rotation") = 1e-3);
  m.def("join", &join, py::arg("members"),
        "The members as one tree of frames in depth-first order. Frames and owners of a robot's parameters become "
        "'NAME.joint3', those of one frame 'NAME'; gravity is that of the first robot on the world.");
  m.def(
      "read_urdf",
      [](const std::string& xml, const std::string& base_link, const std::string& tip_link) {
        return chain_dict(read_urdf(xml, base_link, tip_link));
      },
      py::arg("xml_text"), py::arg("base_link") = "", py::arg("tip_link") = "",
      "The chain from base_link to tip_link of a URDF, as a dict of SI numbers; InvalidInput where it is none.");
  m.def("read_urdf_tree", &branch_list, py::arg("xml_text"), py::arg("base_link"), py::arg("tip_links"),
        "The chains from base_link to several tips: pairs of the chain that each begins at the end of (-1: at the "
        "base) and what read_urdf gives. Shared joints are those of one chain, which ends where the ways part.");
}

}  // namespace fastcal
