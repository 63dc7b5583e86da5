// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/arm_structure.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

#include "fastcal/math/check.hpp"

namespace fastcal {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

BeamFrame beam_frame(const StructureDescription& description) {
  BeamFrame frame;
  frame.dimension = 3;
  frame.node_count = static_cast<int>(description.nodes.size());
  for (int k = 0; k < frame.node_count; ++k) {
    const StructureNode& node = description.nodes[at(k)];
    frame.node_names.push_back(node.name);
    if (node.held != 0) frame.supports.push_back({k, node.held});
  }
  for (int e = 0; e < static_cast<int>(description.elements.size()); ++e) {
    const StructureElement& element = description.elements[at(e)];
    frame.element_names.push_back(element.name);
    frame.elements.push_back(element.beam);
    if (element.start_hinge != 0) frame.hinges.push_back({e, 0, element.start_hinge});
    if (element.end_hinge != 0) frame.hinges.push_back({e, 1, element.end_hinge});
  }
  return frame;
}

void add_force(const Eigen::Vector3d& force, const Eigen::Vector3d& lever, Eigen::Ref<Eigen::RowVectorXd> load) {
  load.head<3>() += force.transpose();
  load.tail<3>() += lever.cross(force).transpose();
}

std::string posture_in_words(const State& state, int joints) {
  std::ostringstream text;
  for (int j = 0; j < joints; ++j) text << (j > 0 ? ", " : "") << state.q[j];
  return text.str();
}

}  // namespace

ArmStructure::ArmStructure(StructureDescription description)
    : description_(std::move(description)), solver_(std::make_unique<BeamSolver>(beam_frame(description_))) {
  for (int k = 0; k < static_cast<int>(description_.nodes.size()); ++k) {
    if (description_.nodes[at(k)].moves >= 0) movers_.push_back(k);
  }
  FASTCAL_CHECK(!movers_.empty()) << "no node moves a frame of the chain, so the structure does nothing";
  const auto frame_of = [this](int node) { return description_.nodes[at(node)].moves; };
  std::stable_sort(movers_.begin(), movers_.end(), [&](int a, int b) { return frame_of(a) < frame_of(b); });
  for (const int node : movers_) {
    FASTCAL_CHECK(frames_.empty() || frames_.back() < frame_of(node))
        << "the nodes " << description_.nodes[at(movers_[frames_.size() - 1])].name << " and "
        << description_.nodes[at(node)].name << " move the same frame";
    frames_.push_back(frame_of(node));
  }
  for (const StructureElement& element : description_.elements) group_.push_back(element.group);
}

RowMatrixXd ArmStructure::positions(const State& state) const {
  RowMatrixXd out(description_.nodes.size(), 3);
  for (Eigen::Index k = 0; k < out.rows(); ++k) {
    const StructureNode& node = description_.nodes[static_cast<std::size_t>(k)];
    out.row(k) = state.frames[node.origin].p + state.frames[node.frame].R * node.position;
  }
  return out;
}

RowMatrixXd ArmStructure::loads(const RobotDescription& robot, const State& state, const RowMatrixXd& positions) const {
  RowMatrixXd out = RowMatrixXd::Zero(positions.rows(), 6);
  const Eigen::Map<const Eigen::Vector3d> gravity(state.gravity);
  for (Eigen::Index k = 0; k < out.rows(); ++k) {
    const StructureNode& node = description_.nodes[static_cast<std::size_t>(k)];
    const Eigen::Vector3d here = positions.row(k);
    out.row(k).head<3>() += node.mass * gravity.transpose();
    for (const int link : node.links) {
      const Pose body = state.frames[joint_frame(link)] * state.chain->body_frames[at(link)];
      const double mass = robot.bodies[at(link)].mass + state.weights->mass[link];
      const Eigen::Vector3d moment = mass * robot.bodies[at(link)].com + state.weights->moment.col(link);
      out.row(k).head<3>() += mass * gravity.transpose();
      out.row(k).tail<3>() += (body.R * moment + mass * (body.p - here)).cross(gravity).transpose();
    }
    if (!node.carries_payload) continue;
    const int flange = link_frame(state.chain->joint_count() - 1);
    const Pose& T = state.frames[flange];
    const double* load = state.payload_load + 6 * flange;
    add_force(T.R * Eigen::Map<const Eigen::Vector3d>(load), T.p - here, out.row(k));
    out.row(k).tail<3>() += (T.R * Eigen::Map<const Eigen::Vector3d>(load + 3)).transpose();
  }
  return out;
}

RowMatrixXd ArmStructure::up(const State& state) const {
  RowMatrixXd out(description_.elements.size(), 3);
  for (Eigen::Index e = 0; e < out.rows(); ++e) {
    const StructureElement& element = description_.elements[static_cast<std::size_t>(e)];
    out.row(e) = state.frames[element.up_frame].R * element.up;
  }
  return out;
}

RowMatrixXd ArmStructure::stiffness(const State& state) const {
  RowMatrixXd out(solver_->sampled_count(), 36);
  Eigen::Index row = 0;
  for (const StructureElement& element : description_.elements) {
    if (!element.beam.sampled) continue;
    Eigen::Map<Matrix6d> to(out.row(row++).data());  // symmetric: order does not matter
    to = element.stiffness;
    if (element.table < 0) continue;
    const StructureTable& own = description_.tables[at(element.table)];
    const auto position = [&](int joint, const StiffnessTable::Range& range) {
      return Eigen::VectorXd::Constant(1, joint < 0 ? range.low : std::clamp(state.q[joint], range.low, range.high));
    };
    const RowMatrixXd K = own.table.evaluate(position(own.angle_joint, own.table.angle_range()),
                                             position(own.extension_joint, own.table.extension_range()));
    to = Eigen::Map<const Matrix6d>(K.data());
  }
  return out;
}

void ArmStructure::basis(const RobotDescription& robot, const State& state, const double* scale, double* B) const {
  const RowMatrixXd nodes = positions(state), load = loads(robot, state, nodes), side = up(state), K = stiffness(state);
  const Eigen::Index count = nodes.rows();
  const int group_count = static_cast<int>(description_.groups.size());
  BeamPostures posture;
  posture.count = 1;
  posture.nodes = nodes.data();
  posture.load = {load.data(), 0};
  posture.gravity = {state.gravity, 0};
  posture.up = {side.data(), 0};
  if (K.size() > 0) posture.stiffness = {K.data(), 0};
  std::vector<double> factor;
  for (const int group : group_) factor.push_back(1 / scale[group]);
  RowMatrixXd displacement(count, 6), derivative(count * 6, group_count);
  try {
    if (group_count == 1) {
      solver_->solve(posture, factor, 1, displacement.data());
      derivative = Eigen::Map<const Eigen::VectorXd>(displacement.data(), count * 6) / scale[0];
    } else {
      solver_->solve_with_derivative(posture, factor, group_, group_count, 1, displacement.data(), derivative.data());
      for (int g = 0; g < group_count; ++g) derivative.col(g) /= -scale[g];  // stiffness is 1 / scale
    }
  } catch (const InvalidInput& error) {
    const std::string reason = error.what();
    FASTCAL_CHECK(false) << "the structure has no solution at q = ("
                         << posture_in_words(state, state.chain->joint_count())
                         << ") rad, m: " << reason.substr(reason.find(": ") + 2);
  }
  for (int g = 0; g < group_count; ++g) {
    Eigen::Vector3d at_frame = Eigen::Vector3d::Zero(), U = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      const Pose& T = state.frames[frames_[f]];
      const Eigen::Vector3d u = derivative.col(g).segment<3>(6 * movers_[f]);
      const Eigen::Vector3d phi = derivative.col(g).segment<3>(6 * movers_[f] + 3);
      const Eigen::Vector3d moved = u + phi.cross(T.p - nodes.row(movers_[f]).transpose());
      Eigen::Map<Vector6d> xi(B + 6 * (f * at(group_count) + at(g)));
      xi.head<3>() = T.R.transpose() * (moved - U - turn.cross(T.p - at_frame));
      xi.tail<3>() = T.R.transpose() * (phi - turn);
      at_frame = T.p;
      U = moved;
      turn = phi;
    }
  }
}

}  // namespace fastcal
