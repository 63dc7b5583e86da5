// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/state.hpp"

#include "fastcal/math/check.hpp"

namespace fastcal {

void Samples::check(int joint_count) const {
  FASTCAL_CHECK(q.cols() == joint_count) << "q must have shape (N, " << joint_count << "), got (" << q.rows() << ", "
                                         << q.cols() << ")";
  FASTCAL_CHECK(q.allFinite()) << "q must be finite";
  const auto vector = [this](const auto& values, const char* name) {
    FASTCAL_CHECK(values.size() == 0 || values.size() == q.rows())
        << name << " must have shape (" << q.rows() << ",), got (" << values.size() << ",)";
  };
  const auto shape = [this](const RowMatrixXd& values, Eigen::Index cols, const char* name) {
    FASTCAL_CHECK(values.size() == 0 || (values.rows() == q.rows() && values.cols() == cols))
        << name << " must have shape (" << q.rows() << ", " << cols << "), got (" << values.rows() << ", "
        << values.cols() << ")";
  };
  vector(payload, "payload");
  vector(temperature, "temperature");
  vector(time, "time");
  vector(station, "station");
  vector(mount, "mount");
  shape(wrench, 6, "wrench");
  shape(approach, joint_count, "approach");
  shape(current, joint_count, "current");
  shape(extra, extra.cols(), "extra");
  shape(table, table.cols(), "table");
}

Samples Samples::slice(Eigen::Index begin, Eigen::Index end) const {
  Samples out;
  const auto cut = [begin, end](const auto& from, auto& to) {
    if (from.size() > 0) to = from.middleRows(begin, end - begin);
  };
  cut(q, out.q);
  cut(payload, out.payload);
  cut(wrench, out.wrench);
  cut(temperature, out.temperature);
  cut(time, out.time);
  cut(station, out.station);
  cut(mount, out.mount);
  cut(approach, out.approach);
  cut(current, out.current);
  cut(extra, out.extra);
  cut(table, out.table);
  return out;
}

}  // namespace fastcal
