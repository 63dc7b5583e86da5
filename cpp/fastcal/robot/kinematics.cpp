// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/kinematics.hpp"

#include <cmath>

#include "fastcal/math/se3.hpp"

namespace fastcal {

void forward(const Chain& chain, const double* q, const Twists* xi, std::vector<Pose>& T_world_frame) {
  const int frames = chain.frame_count();
  T_world_frame.resize(static_cast<std::size_t>(frames));
  Pose T;
  for (int f = 0; f < frames; ++f) {
    T = T * chain.constants[static_cast<std::size_t>(f)];
    if (f % 2 == 1 && f < frames - 1) {
      const int joint = f / 2;
      if (chain.joint_types[static_cast<std::size_t>(joint)] == JointType::kRevolute) {
        const double c = std::cos(q[joint]);
        const double s = std::sin(q[joint]);
        const Eigen::Vector3d x = T.R.col(0);
        T.R.col(0) = c * x + s * T.R.col(1);
        T.R.col(1) = c * T.R.col(1) - s * x;
      } else {
        T.p += q[joint] * T.R.col(2);
      }
    }
    if (xi != nullptr && !xi->col(f).isZero(0)) T = T * exp_se3(xi->col(f));
    T_world_frame[static_cast<std::size_t>(f)] = T;
  }
}

}  // namespace fastcal
