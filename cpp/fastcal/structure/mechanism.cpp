// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/mechanism.hpp"

#include <cmath>
#include <cstdio>
#include <sstream>
#include <utility>
#include <vector>

#include "fastcal/math/decompositions.hpp"

namespace fastcal {
namespace {

/// "y", "-x", or "(0.60, 0.80)" where no axis will do.
std::string direction_in_words(Eigen::VectorXd direction) {
  direction.normalize();
  const double size = direction.cwiseAbs().maxCoeff();
  Eigen::Index first = 0;
  while (std::abs(direction[first]) < size / 2) ++first;
  if (direction[first] < 0) direction = -direction;  // a mechanism moves both ways
  if (size > 1 - 1e-6) return {"xyz"[first]};
  std::string words = "(";
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    char number[16];
    std::snprintf(number, sizeof number, "%.2f", direction[i] + 0.0);
    words += (i > 0 ? ", " : "") + std::string(number);
  }
  return words + ")";
}

Eigen::Map<const Eigen::VectorXd> row_of(const double* data, std::ptrdiff_t offset, int size) {
  return {data + offset, size};
}

/// What is wrong with an element's geometry at this posture, or nothing.
std::string explain_geometry(const BeamFrame& frame, const beam::BeamPlan& plan, const beam::BeamBatch& batch,
                             std::ptrdiff_t posture) {
  const int D = frame.dimension;
  std::ostringstream text;
  for (int e = 0; e < plan.element_count; ++e) {
    const BeamElement& element = frame.elements[static_cast<std::size_t>(e)];
    const double* nodes = batch.nodes + posture * plan.node_count * D;
    const Eigen::VectorXd lever = row_of(nodes, element.end * D, D) - row_of(nodes, element.start * D, D);
    if (lever.norm() == 0) {
      text << "element " << frame.element_name(e) << " has no length, nodes " << frame.node_name(element.start)
           << " and " << frame.node_name(element.end) << " coincide";
      return text.str();
    }
    if (D == 2 || plan.round[e]) continue;
    const Eigen::Vector3d up = row_of(batch.up.data, posture * batch.up.stride + 3 * e, 3);
    const Eigen::Vector3d axis = lever.normalized();
    if (!(axis.cross(up).norm() > 1e-6 * up.norm())) {
      text << "the y axis of element " << frame.element_name(e) << " is not known: its `up` direction "
           << direction_in_words(up) << " runs along it; give another";
      return text.str();
    }
  }
  return {};
}

/// The stiffness matrix of one posture without its held directions, and which node and direction each row is.
struct FreeStiffness {
  Eigen::MatrixXd K;
  std::vector<std::pair<int, int>> owner;
};

FreeStiffness free_stiffness(const BeamFrame& frame, const beam::BeamPlan& plan, const beam::Lane* blocks) {
  const int B = frame.freedom_count();
  const auto entry = [&](int block, int row, int column) { return blocks[(block * B + row) * B + column][0]; };
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(plan.free_count * B, plan.free_count * B);
  for (int k = 0; k < plan.free_count; ++k) {
    for (int r = 0; r < B; ++r) {
      for (int c = 0; c <= r; ++c) K(k * B + r, k * B + c) = entry(k, r, c);
    }
    for (int s = plan.slot_begin[k]; s < plan.slot_begin[k + 1]; ++s) {
      for (int r = 0; r < B; ++r) {
        for (int c = 0; c < B; ++c) K(plan.slot_row[s] * B + r, k * B + c) = entry(plan.free_count + s, r, c);
      }
    }
  }
  FreeStiffness free;
  std::vector<Eigen::Index> rows;
  for (int i = 0; i < plan.free_count * B; ++i) {
    if (plan.held[i / B] >> i % B & 1u) continue;
    rows.push_back(i);
    free.owner.emplace_back(plan.node[i / B], i % B);
  }
  free.K = Eigen::MatrixXd(K.selfadjointView<Eigen::Lower>())(rows, rows);
  return free;
}

std::string explain_motion(const BeamFrame& frame, const FreeStiffness& free) {
  const Eigen::VectorXd diagonal = free.K.diagonal();
  std::ostringstream text;
  Eigen::Index weakest = 0;
  if (!(diagonal.minCoeff(&weakest) >= -1e-9 * diagonal.maxCoeff())) {
    text << "the stiffness at node " << frame.node_name(free.owner[static_cast<std::size_t>(weakest)].first)
         << " is not positive";
    return text.str();
  }
  const double floor = 1e-14 * diagonal.maxCoeff();  // a row of zeros is a motion of its own
  const Eigen::VectorXd scaling = diagonal.cwiseMax(floor).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(scaling.asDiagonal() * free.K * scaling.asDiagonal()));
  if (eigen.eigenvalues()[0] < -1e-9) {
    text << "the sampled stiffness of an element is not positive definite";
    return text.str();
  }
  const Eigen::VectorXd mode = scaling.cwiseProduct(eigen.eigenvectors().col(0));
  const int D = frame.dimension, R = frame.freedom_count() - D;
  Eigen::MatrixXd shift = Eigen::MatrixXd::Zero(D, frame.node_count), turn = Eigen::MatrixXd::Zero(R, frame.node_count);
  for (Eigen::Index i = 0; i < mode.size(); ++i) {
    const auto& [node, direction] = free.owner[static_cast<std::size_t>(i)];
    (direction < D ? shift(direction, node) : turn(direction - D, node)) = mode[i];
  }
  Eigen::Index moved = 0, turned = 0;
  const double shift_size = shift.colwise().norm().maxCoeff(&moved);
  const double turn_size = turn.colwise().norm().maxCoeff(&turned);
  if (shift_size > 1e-6 * turn_size) {
    text << "node " << frame.node_name(static_cast<int>(moved)) << " is free to move along "
         << direction_in_words(shift.col(moved));
  } else {
    text << "node " << frame.node_name(static_cast<int>(turned)) << " is free to turn about "
         << (D == 2 ? "z" : direction_in_words(turn.col(turned)));
  }
  return text.str();
}

/// A moment on a rotation that nothing holds: its node, or nothing.
std::string explain_moment(const BeamFrame& frame, const beam::BeamPlan& plan, const beam::BeamBatch& batch,
                           std::ptrdiff_t posture, const beam::Lane* loose) {
  if (batch.load.data == nullptr) return {};
  const int B = frame.freedom_count(), D = frame.dimension;
  for (int k = 0; k < plan.loose_count; ++k) {
    const int node = plan.node[plan.loose_position[k]];
    const Eigen::VectorXd moment = row_of(batch.load.data, posture * batch.load.stride + node * B + D, B - D);
    Eigen::MatrixXd projector(B - D, B - D);
    for (int i = 0; i < projector.size(); ++i) projector(i / (B - D), i % (B - D)) = loose[10 * k + i][0];
    if ((projector * moment).norm() <= 1e-8 * moment.norm()) continue;
    std::ostringstream text;
    text << "a moment acts on node " << frame.node_name(node) << " about "
         << (D == 2 ? "z" : direction_in_words(projector * moment)) << ", where its hinges leave nothing to hold it";
    return text.str();
  }
  return {};
}

}  // namespace

std::string explain_mechanism(const BeamFrame& frame, const beam::BeamPlan& plan, const beam::BeamBatch& batch,
                              std::ptrdiff_t posture) {
  std::string reason = explain_geometry(frame, plan, batch, posture);
  std::vector<beam::LaneStorage> storage(beam::work_lanes(plan));
  const beam::AssembledLanes lanes =
      beam::assemble_lanes(plan, batch, posture, reinterpret_cast<beam::Lane*>(storage.data()));
  if (reason.empty()) reason = explain_moment(frame, plan, batch, posture, lanes.loose);
  if (reason.empty()) reason = explain_motion(frame, free_stiffness(frame, plan, lanes.blocks));
  return "the frame can't be solved at posture " + std::to_string(posture) + ": " + reason;
}

}  // namespace fastcal
