// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/structure/beam_solver.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/structure/elimination.hpp"
#include "fastcal/structure/mechanism.hpp"

namespace fastcal {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// E A, E I_y, E I_z, G J, G A_y, G A_z, mass, scale.
std::array<double, beam::kSectionNumbers> section_numbers(const BeamElement& e) {
  return {e.young * e.area,
          e.young * e.inertia_y,
          e.young * e.inertia_z,
          e.shear * e.torsion,
          e.shear * e.shear_area_y,
          e.shear * e.shear_area_z,
          e.mass,
          1.0};
}

}  // namespace

/// What BeamPlan points to.
struct BeamSolver::Arrays {
  beam::Elimination elimination;
  std::vector<int> end_node, end_position, end_loose, coupling, sampled, node, loose_position;
  std::vector<double> section;
  std::vector<unsigned> released, kept, held;
  std::unique_ptr<bool[]> round;
};

BeamSolver::BeamSolver(BeamFrame frame) : frame_(std::move(frame)), arrays_(std::make_unique<Arrays>()) {
  check(frame_);
  plan_.dimension = frame_.dimension;
  plan_.node_count = frame_.node_count;
  plan_.element_count = static_cast<int>(frame_.elements.size());
  plan_nodes();
  plan_elements();
}

BeamSolver::~BeamSolver() = default;

void BeamSolver::plan_nodes() {
  Arrays& arrays = *arrays_;
  std::vector<unsigned> directions(at(frame_.node_count), 0);
  for (const BeamSupport& support : frame_.supports) directions[at(support.node)] |= support.directions;
  std::vector<bool> fixed(directions.size());
  std::transform(directions.begin(), directions.end(), fixed.begin(),
                 [this](unsigned held) { return held == frame_.all_directions(); });
  std::vector<std::pair<int, int>> edges;
  for (const BeamElement& element : frame_.elements) edges.emplace_back(element.start, element.end);

  arrays.elimination = beam::plan_elimination(edges, fixed);
  const beam::Elimination& elimination = arrays.elimination;
  arrays.node.resize(at(elimination.free_count));
  arrays.held.resize(at(elimination.free_count));
  for (int node = 0; node < frame_.node_count; ++node) {
    const int position = elimination.position[at(node)];
    if (position < 0) continue;
    arrays.node[at(position)] = node;
    arrays.held[at(position)] = directions[at(node)];
  }
  plan_.free_count = elimination.free_count;
  plan_.block_count = elimination.block_count();
  plan_.slot_begin = elimination.slot_begin.data();
  plan_.slot_row = elimination.slot_row.data();
  plan_.update = elimination.update.data();
  plan_.node = arrays.node.data();
}

void BeamSolver::plan_elements() {
  Arrays& arrays = *arrays_;
  const beam::Elimination& elimination = arrays.elimination;
  const unsigned all_axes = frame_.dimension == 2 ? 4u : 7u;
  const std::size_t count = frame_.elements.size();
  arrays.released.assign(2 * count, 0);
  for (const BeamHinge& hinge : frame_.hinges) arrays.released[at(2 * hinge.element + hinge.end)] |= hinge.axes;
  arrays.round = std::make_unique<bool[]>(count);
  std::vector<bool> may_be_loose(at(plan_.free_count), true);
  for (std::size_t i = 0; i < count; ++i) {
    const BeamElement& element = frame_.elements[i];
    const int start = elimination.position[at(element.start)], end = elimination.position[at(element.end)];
    arrays.coupling.push_back(start < 0 || end < 0 ? -1
                                                   : elimination.block(std::max(start, end), std::min(start, end)));
    arrays.sampled.push_back(element.sampled ? plan_.sampled_count++ : -1);
    const auto numbers = section_numbers(element);
    arrays.section.insert(arrays.section.end(), numbers.begin(), numbers.end());
    const auto alike = [](unsigned axes) { return (axes & 6u) == 0 || (axes & 6u) == 6u; };
    arrays.round[i] = !element.sampled && element.inertia_y == element.inertia_z &&
                      element.shear_area_y == element.shear_area_z && alike(arrays.released[2 * i]) &&
                      alike(arrays.released[2 * i + 1]);
    const unsigned spins = (arrays.released[2 * i] | arrays.released[2 * i + 1]) & 1u;
    for (std::size_t side = 0; side < 2; ++side) {
      const int position = side == 0 ? start : end;
      const unsigned kept = all_axes & ~(arrays.released[2 * i + side] | spins);
      arrays.end_node.push_back(side == 0 ? element.start : element.end);
      arrays.end_position.push_back(position);
      arrays.kept.push_back(kept);
      if (position >= 0 && kept == all_axes) may_be_loose[at(position)] = false;
    }
  }
  std::vector<int> loose(at(plan_.free_count), -1);
  for (std::size_t position = 0; position < may_be_loose.size(); ++position) {
    if (!may_be_loose[position]) continue;
    loose[position] = plan_.loose_count++;
    arrays.loose_position.push_back(static_cast<int>(position));
    if (frame_.dimension == 2) arrays.held[position] |= 4u;  // in the plane there is one rotation, and it is loose
  }
  for (const int position : arrays.end_position) arrays.end_loose.push_back(position < 0 ? -1 : loose[at(position)]);
  plan_.end_node = arrays.end_node.data();
  plan_.end_position = arrays.end_position.data();
  plan_.end_loose = arrays.end_loose.data();
  plan_.coupling = arrays.coupling.data();
  plan_.sampled = arrays.sampled.data();
  plan_.released = arrays.released.data();
  plan_.kept = arrays.kept.data();
  plan_.round = arrays.round.get();
  plan_.held = arrays.held.data();
  plan_.loose_position = arrays.loose_position.data();
}

void BeamSolver::run(const BeamPostures& postures, const std::vector<double>& scale, beam::BeamBatch batch,
                     int threads) const {
  const int elements = plan_.element_count;
  FASTCAL_CHECK(scale.empty() || scale.size() == at(elements))
      << "scale must have one number for each of " << elements << " elements, got " << scale.size();
  std::vector<double> section = arrays_->section;
  for (int e = 0; !scale.empty() && e < elements; ++e) {
    FASTCAL_CHECK(scale[at(e)] > 0) << "scale of element " << e << " must be positive, got " << scale[at(e)];
    double* numbers = section.data() + e * beam::kSectionNumbers;
    for (int i = 0; i < 6; ++i) numbers[i] *= scale[at(e)];
    numbers[7] = scale[at(e)];
  }
  beam::BeamPlan plan = plan_;
  plan.section = section.data();

  std::vector<double> z(3 * at(elements), 0.0);
  for (int e = 0; e < elements; ++e) z[3 * at(e) + 2] = 1.0;
  batch.nodes = postures.nodes;
  batch.load = postures.load;
  batch.gravity = postures.gravity;
  batch.up = postures.up.data != nullptr ? postures.up : beam::Rows{z.data(), 0};
  batch.stiffness = postures.stiffness;
  FASTCAL_CHECK(plan.sampled_count == 0 || batch.stiffness.data != nullptr)
      << "the frame has " << plan.sampled_count << " elements whose stiffness must be given with the postures";

  parallel_chunks(postures.count, threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    std::vector<beam::LaneStorage> storage(beam::work_lanes(plan));
    auto* work = reinterpret_cast<beam::Lane*>(storage.data());
    for (Eigen::Index first = begin; first < end; first += beam::kLanes) {
      const int count = static_cast<int>(std::min<Eigen::Index>(beam::kLanes, end - first));
      const unsigned failed = beam::solve_lanes(plan, batch, first, count, work);
      for (int lane = 0; lane < count; ++lane) {
        FASTCAL_CHECK((failed >> lane & 1u) == 0) << explain_mechanism(frame_, plan, batch, first + lane);
      }
    }
  });
}

void BeamSolver::solve(const BeamPostures& postures, const std::vector<double>& scale, int threads,
                       double* displacement) const {
  std::fill_n(displacement, postures.count * frame_.node_count * frame_.freedom_count(), 0.0);
  beam::BeamBatch batch;
  batch.displacement = displacement;
  run(postures, scale, batch, threads);
}

void BeamSolver::solve_with_derivative(const BeamPostures& postures, const std::vector<double>& scale,
                                       const std::vector<int>& group, int group_count, int threads,
                                       double* displacement, double* derivative) const {
  FASTCAL_CHECK(group.size() == frame_.elements.size())
      << "group must have one number for each of " << frame_.elements.size() << " elements, got " << group.size();
  const Eigen::Index size = postures.count * frame_.node_count * frame_.freedom_count();
  std::fill_n(displacement, size, 0.0);
  std::fill_n(derivative, size * group_count, 0.0);
  beam::BeamBatch batch;
  batch.displacement = displacement;
  batch.group = group.data();
  batch.group_count = group_count;
  batch.derivative = derivative;
  run(postures, scale, batch, threads);
}

}  // namespace fastcal
