// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Simulated measurements of a known truth.
#pragma once

#include <algorithm>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "fastcal/identification/identify.hpp"
#include "support/robots.hpp"

namespace fastcal::test {

inline Samples postures(Random& random, Eigen::Index rows, int joints, double reach = 2.5) {
  Samples samples;
  samples.q = RowMatrixXd::NullaryExpr(rows, joints, [&] { return random.uniform(-reach, reach); });
  return samples;
}

struct Noise {
  double position = 0;  ///< [m]
  double rotation = 0;  ///< [rad]
};

enum class What { kPositions, kPoses };

/// Tables of what was measured of a robot, which a test may change; read as Measurements whenever these are asked for.
struct Measured {
  std::optional<RobotModel> robot;
  RowMatrixXd position, rotation, sigma_position;
  Eigen::VectorXd distance, sigma_rotation;
  Eigen::VectorXi anchor;
  int anchor_count = 0;

  operator const Measurements&() const {
    fastcal::Tables tables{std::max({position.rows(), rotation.rows(), distance.rows()}), {}, {}};
    tables.numbers = {{"position", position},
                      {"rotation", rotation},
                      {"distance", distance},
                      {"sigma_position", sigma_position},
                      {"sigma_rotation", sigma_rotation}};
    Labels anchors{anchor, {}};
    for (int a = 0; a < anchor_count; ++a) anchors.names.push_back(std::to_string(a));
    tables.labels = {{"anchor", anchors}};
    read_ = Measurements(tables, *robot);
    return read_;
  }

 private:
  mutable Measurements read_;
};

/// What a device sees of the robot at parameters `truth`.
inline Measured measure(Random& random, const ErrorModel& model, const Samples& samples, const Eigen::VectorXd& truth,
                        What what, const Noise& noise) {
  Measured out;
  out.robot = model.robot();
  out.position.resize(samples.count(), 3);
  if (what == What::kPoses) out.rotation.resize(samples.count(), 4);
  RowEvaluator rows(model, truth);
  for (Eigen::Index i = 0; i < samples.count(); ++i) {
    const Pose& T = rows.pose(samples.row(i));
    out.position.row(i) = (T.p + random.normals(noise.position)).transpose();
    if (what == What::kPositions) continue;
    const Eigen::Quaterniond q(T.R * exp_so3(random.normals(noise.rotation)));
    out.rotation.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  return out;
}

/// Parameters of the robot that positions (or poses) can show: all, without the turn of the tool under positions.
inline std::vector<int> asked(const ErrorModel& model, What what) {
  std::vector<int> out(static_cast<std::size_t>(model.parameter_count() - (what == What::kPositions ? 3 : 0)));
  std::iota(out.begin(), out.end(), 0);
  return out;
}

inline std::string name(const ErrorModel& model, int k) {
  const Parameter& p = model.parameters()[static_cast<std::size_t>(k)];
  return p.owner + " " + p.name;
}

inline int index_of(const ErrorModel& model, const std::string& wanted) {
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (name(model, k) == wanted) return k;
  }
  return -1;
}

/// The robot's own values, and on the parameters of its joints, base and tool normal errors: metres and radians alike.
inline Eigen::VectorXd disturbed(Random& random, const ErrorModel& model, double size) {
  return model.start() + Eigen::VectorXd::NullaryExpr(model.parameter_count(), [&] { return random.normal(size); });
}

/// RMS distance of the tool between two parameter vectors.
inline double rms_distance(const ErrorModel& model, const Samples& samples, const Eigen::VectorXd& a,
                           const Eigen::VectorXd& b) {
  double sum = 0;
  RowEvaluator at_a(model, a);
  RowEvaluator at_b(model, b);
  for (Eigen::Index i = 0; i < samples.count(); ++i)
    sum += (at_a.pose(samples.row(i)).p - at_b.pose(samples.row(i)).p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(samples.count()));
}

}  // namespace fastcal::test
