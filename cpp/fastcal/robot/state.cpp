// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/state.hpp"

#include "fastcal/math/check.hpp"

namespace fastcal {

void Samples::check_finite(Eigen::Index begin, Eigen::Index end) const {
  // allFinite looks at one number at a time.
  FASTCAL_CHECK((0 * q.table().middleRows(begin, end - begin)).sum() == 0) << "q must be finite";
}

void Samples::check_shapes(int joint_count) const {
  FASTCAL_CHECK(q.cols() == joint_count) << "q must have shape (N, " << joint_count << "), got (" << q.rows() << ", "
                                         << q.cols() << ")";
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

namespace {

/// The tables of `from`, each as `cut` leaves it.
template <typename Cut>
Samples tables(const Samples& from, const Cut& cut_one) {
  Samples out;
  const auto cut = [&cut_one](const auto& table, auto& to) {
    if (table.size() > 0) to = cut_one(table);
  };
  cut(from.q.table(), out.q);
  cut(from.payload, out.payload);
  cut(from.wrench, out.wrench);
  cut(from.temperature, out.temperature);
  cut(from.time, out.time);
  cut(from.station, out.station);
  cut(from.mount, out.mount);
  cut(from.approach, out.approach);
  cut(from.current, out.current);
  cut(from.extra, out.extra);
  cut(from.table, out.table);
  return out;
}

}  // namespace

Samples Samples::slice(Eigen::Index begin, Eigen::Index end) const {
  return tables(*this, [begin, end](const auto& table) { return table.middleRows(begin, end - begin); });
}

Samples Samples::pick(const std::vector<Eigen::Index>& rows) const {
  const auto cut = [&rows](const auto& table) { return table(rows, Eigen::all); };
  Samples out = tables(*this, cut);
  if (load.size() == 0) return out;
  out.chain = chain;
  out.gravity = gravity;
  out.weights = weights;
  out.load = cut(load);
  out.payload_load = cut(payload_load);
  out.output = cut(output);
  out.compliance = cut(compliance);
  out.spring = cut(spring);
  if (bending.size() > 0) out.bending = cut(bending);
  const auto width = static_cast<Eigen::Index>(frames.size()) / count();
  for (const Eigen::Index row : rows)
    out.frames.insert(out.frames.end(), frames.begin() + row * width, frames.begin() + (row + 1) * width);
  return out;
}

}  // namespace fastcal
