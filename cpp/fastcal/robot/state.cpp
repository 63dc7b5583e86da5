// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/state.hpp"

#include "fastcal/math/check.hpp"

namespace fastcal {

void Samples::check(int joint_count) const {
  FASTCAL_CHECK(q.cols() == joint_count) << "q must have shape (N, " << joint_count << "), got (" << q.rows() << ", " << q.cols() << ")";
  FASTCAL_CHECK(q.allFinite()) << "q must be finite";
  const auto vector = [this](const auto& values, const char* name) {
    FASTCAL_CHECK(values.size() == 0 || values.size() == q.rows()) << name << " must have shape (" << q.rows() << ",), got (" << values.size() << ",)";
  };
  const auto table = [this](const RowMatrixXd& values, Eigen::Index cols, const char* name) {
    FASTCAL_CHECK(values.size() == 0 || (values.rows() == q.rows() && values.cols() == cols))
        << name << " must have shape (" << q.rows() << ", " << cols << "), got (" << values.rows() << ", " << values.cols() << ")";
  };
  vector(payload, "payload");
  vector(temperature, "temperature");
  vector(time, "time");
  vector(station, "station");
  vector(mount, "mount");
  table(wrench, 6, "wrench");
  table(approach, joint_count, "approach");
  table(current, joint_count, "current");
  table(extra, extra.cols(), "extra");
  table(load, 6 * (2 * joint_count + 2), "load");
  table(payload_load, 6 * (2 * joint_count + 2), "payload_load");
}

}  // namespace fastcal
