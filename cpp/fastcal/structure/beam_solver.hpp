// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Displacements of a frame of beams by the matrix displacement method, K u = f, in batches of postures.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "fastcal/structure/beam_frame.hpp"
#include "fastcal/structure/beam_kernel.hpp"

namespace fastcal {

/// Loads and shapes of N postures. A Rows with stride 0 holds for all of them. M nodes, D dimensions, B = 3 or 6.
struct BeamPostures {
  Eigen::Index count = 0;
  const double* nodes = nullptr;  ///< (N, M, D) [m]
  beam::Rows load;                ///< (M, B) on the nodes [N, N m], global axes; data null: none
  beam::Rows gravity;             ///< (D) [m/s^2]
  beam::Rows up;                  ///< (elements, 3) a direction in each element's local x-z plane; data null: global z
  beam::Rows stiffness;           ///< (sampled elements, B, B): see stiffness_table.hpp
};

/// A frame made ready: order of elimination, fill and loose rotations are found once, postures cost arithmetic only.
class BeamSolver {
 public:
  /// Throws InvalidInput where the frame is invalid (check(BeamFrame)).
  explicit BeamSolver(BeamFrame frame);
  ~BeamSolver();
  BeamSolver(const BeamSolver&) = delete;
  BeamSolver& operator=(const BeamSolver&) = delete;

  const BeamFrame& frame() const { return frame_; }
  /// How many elements have a stiffness that is given with each posture.
  int sampled_count() const { return plan_.sampled_count; }

  /// Displacements (N, M, B): [m, rad], global axes; 0 where held and for a rotation that nothing holds. `scale`
  /// (elements, or empty: 1) multiplies the elements' stiffness. The same bits whatever `threads` is.
  /// Throws InvalidInput naming the posture, the node and the direction where the frame is a mechanism.
  void solve(const BeamPostures& postures, const std::vector<double>& scale, int threads, double* displacement) const;

  /// The same, and `derivative` (N, M, B, groups) of the displacements by a factor on the stiffness of each group of
  /// elements, at factor 1 on top of `scale`: K du/ds = -K_group u. `group` (elements): column, or -1.
  void solve_with_derivative(const BeamPostures& postures, const std::vector<double>& scale,
                             const std::vector<int>& group, int group_count, int threads, double* displacement,
                             double* derivative) const;

 private:
  void run(const BeamPostures& postures, const std::vector<double>& scale, beam::BeamBatch batch, int threads) const;
  void plan_elements();
  void plan_nodes();

  BeamFrame frame_;
  beam::BeamPlan plan_{};
  struct Arrays;
  std::unique_ptr<Arrays> arrays_;
};

}  // namespace fastcal
