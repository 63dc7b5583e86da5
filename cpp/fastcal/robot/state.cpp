// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/robot/state.hpp"

#include <limits>
#include <string>

#include "fastcal/math/check.hpp"

namespace fastcal {

void Samples::check_finite(Eigen::Index begin, Eigen::Index end) const {
  // allFinite looks at one number at a time.
  FASTCAL_CHECK((0 * q.table().middleRows(begin, end - begin)).sum() == 0) << "q must be finite";
}

void Samples::check_shapes(const FrameTree& tree) const {
  const int joint_count = tree.joint_count(), arms = tree.arm_count();
  FASTCAL_CHECK(q.cols() == joint_count) << "q must have shape (N, " << joint_count << "), got (" << q.rows() << ", "
                                         << q.cols() << ")";
  const auto shape = [this](const auto& values, Eigen::Index cols, const char* name) {
    const auto of = [](Eigen::Index n, Eigen::Index k) {
      return k == 1 ? std::to_string(n) + "," : std::to_string(n) + ", " + std::to_string(k);
    };
    FASTCAL_CHECK(values.size() == 0 || (values.rows() == q.rows() && values.cols() == cols))
        << name << " must have shape (" << of(q.rows(), cols) << "), got (" << of(values.rows(), values.cols()) << ")";
  };
  shape(payload, arms, "payload");
  shape(temperature, arms, "temperature");
  shape(time, 1, "time");
  shape(station, arms, "station");
  shape(mount, arms, "mount");
  shape(wrench, Eigen::Index{6} * arms, "wrench");
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

Samples side_by_side(const std::vector<Samples>& arms) {
  FASTCAL_CHECK(!arms.empty()) << "expected the postures of at least one arm";
  const Eigen::Index rows = arms.front().count();
  const auto put = [&](auto Samples::*table, const auto& width, auto missing, auto& to) {
    Eigen::Index columns = 0;
    bool is_known = false;
    for (const Samples& arm : arms) {
      columns += width(arm);
      is_known = is_known || (arm.*table).size() > 0;
    }
    if (!is_known) return;
    to.setConstant(rows, columns, missing);
    Eigen::Index first = 0;
    for (const Samples& arm : arms) {
      if ((arm.*table).size() > 0) to.middleCols(first, width(arm)) = arm.*table;
      first += width(arm);
    }
  };
  const auto joints = [](const Samples& arm) { return arm.q.cols(); };
  const auto one = [](const Samples&) { return Eigen::Index{1}; };
  const auto six = [](const Samples&) { return Eigen::Index{6}; };
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  Samples out;
  Eigen::Index count = 0;
  for (const Samples& arm : arms) count += arm.q.cols();
  RowMatrixXd q(rows, count);
  count = 0;
  for (const Samples& arm : arms) {
    FASTCAL_CHECK(arm.count() == rows) << "expected " << rows << " postures of each arm, got " << arm.count();
    q.middleCols(count, arm.q.cols()) = arm.q.table();
    count += arm.q.cols();
    if (out.time.size() == 0) out.time = arm.time;
  }
  out.q = q;
  put(&Samples::payload, one, 0.0, out.payload);
  put(&Samples::temperature, one, unknown, out.temperature);
  put(&Samples::station, one, -1, out.station);
  put(&Samples::mount, one, -1, out.mount);
  put(&Samples::wrench, six, 0.0, out.wrench);
  put(&Samples::approach, joints, 0.0, out.approach);
  put(&Samples::current, joints, unknown, out.current);
  put(
      &Samples::extra, [](const Samples& arm) { return arm.extra.cols(); }, 0.0, out.extra);
  put(
      &Samples::table, [](const Samples& arm) { return arm.table.cols(); }, 0.0, out.table);
  return out;
}

}  // namespace fastcal
