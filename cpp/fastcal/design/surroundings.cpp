// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/design/surroundings.hpp"

#include <algorithm>
#include <cmath>

#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/robot/kinematics.hpp"

namespace fastcal::design {
namespace {

bool inside(const Box& box, const Eigen::Vector3d& p) {
  return (p.array() >= box.low.array()).all() && (p.array() <= box.high.array()).all();
}

bool arm_meets(const std::vector<Box>& boxes, const std::vector<Pose>& frames, double radius) {
  for (std::size_t f = link_frame(0); f + 1 < frames.size(); ++f) {
    for (const Box& box : boxes) {
      if (meets(box, frames[f].p, frames[f + 1].p, radius)) return true;
    }
  }
  return false;
}

Obstacle beam_obstacle(const Surroundings& surroundings, const Tracker& tracker, const std::vector<Pose>& frames,
                       int joint_count) {
  const Eigen::Vector3d& target = frames.back().p;
  const Eigen::Vector3d beam = tracker.position - target;
  const double range = beam.norm();
  if (!(range >= tracker.nearest && range <= tracker.farthest)) return Obstacle::kRange;
  if (tracker.reflector.squaredNorm() > 0) {
    const Eigen::Vector3d look = frames.back().R * tracker.reflector.normalized();
    if (std::atan2(look.cross(beam).norm(), look.dot(beam)) > tracker.acceptance) return Obstacle::kAcceptance;
  }
  for (const Box& box : surroundings.keep_out) {
    if (meets(box, target, tracker.position, 0)) return Obstacle::kSight;
  }
  for (int f = kBaseFrame; f < joint_frame(joint_count - 1); ++f) {
    const auto i = static_cast<std::size_t>(f);
    if (segment_distance(frames[i].p, frames[i + 1].p, target, tracker.position) < surroundings.link_radius) {
      return Obstacle::kSight;
    }
  }
  return Obstacle::kNone;
}

void check(const Surroundings& surroundings) {
  const auto check_box = [](const Box& box) {
    FASTCAL_CHECK((box.low.array() < box.high.array()).all())
        << "a box needs a lower and a higher corner, got (" << box.low.transpose() << ") and (" << box.high.transpose()
        << ")";
  };
  for (const Box& box : surroundings.keep_out) check_box(box);
  if (surroundings.region) check_box(*surroundings.region);
  FASTCAL_CHECK(surroundings.link_radius >= 0) << "link_radius must be at least 0, got " << surroundings.link_radius;
  if (surroundings.tracker) {
    FASTCAL_CHECK(surroundings.tracker->position.allFinite() && surroundings.tracker->reflector.allFinite())
        << "the tracker's position and the reflector's direction must be finite";
    FASTCAL_CHECK(surroundings.tracker->nearest >= 0 && surroundings.tracker->nearest < surroundings.tracker->farthest)
        << "the tracker's range must rise from 0 or more, got " << surroundings.tracker->nearest << " to "
        << surroundings.tracker->farthest;
  }
}

}  // namespace

bool meets(const Box& box, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double margin) {
  double enter = 0;
  double leave = 1;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double low = box.low[k] - margin - a[k];
    const double high = box.high[k] + margin - a[k];
    const double way = b[k] - a[k];
    if (way == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low / way, high / way));
    leave = std::min(leave, std::max(low / way, high / way));
  }
  return enter <= leave;
}

double segment_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                        const Eigen::Vector3d& d) {
  // |a + s u - c - t v|^2 is convex in (s, t): its least value on the square lies at the unconstrained minimum, or on
  // an edge, where one of the four ends meets the other segment.
  const Eigen::Vector3d u = b - a;
  const Eigen::Vector3d v = d - c;
  const auto to_segment = [](const Eigen::Vector3d& p, const Eigen::Vector3d& from, const Eigen::Vector3d& way) {
    const double square = way.squaredNorm();
    const double s = square > 0 ? std::clamp((p - from).dot(way) / square, 0.0, 1.0) : 0.0;
    return (p - from - s * way).norm();
  };
  double least = std::min({to_segment(a, c, v), to_segment(b, c, v), to_segment(c, a, u), to_segment(d, a, u)});
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double determinant = uu * vv - uv * uv;
  if (determinant > 0) {
    const Eigen::Vector3d w = a - c;
    const double s = (uv * v.dot(w) - vv * u.dot(w)) / determinant;
    const double t = (uu * v.dot(w) - uv * u.dot(w)) / determinant;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) least = std::min(least, (w + s * u - t * v).norm());
  }
  return least;
}

std::vector<Obstacle> obstacles(const RobotModel& robot, const Surroundings& surroundings,
                                const Eigen::Ref<const RowMatrixXd>& q, int threads) {
  check(surroundings);
  FASTCAL_CHECK(q.cols() == robot.joint_count() && q.allFinite())
      << "q must be finite and have " << robot.joint_count() << " joints, got " << q.cols();
  const Chain chain = robot.chain();
  std::vector<Obstacle> out(static_cast<std::size_t>(q.rows()), Obstacle::kNone);
  parallel_chunks(q.rows(), threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    std::vector<Pose> frames;
    for (Eigen::Index i = begin; i < end; ++i) {
      forward(chain, q.row(i).data(), nullptr, frames);
      Obstacle& found = out[static_cast<std::size_t>(i)];
      if (arm_meets(surroundings.keep_out, frames, surroundings.link_radius)) {
        found = Obstacle::kKeepOut;
      } else if (surroundings.region && !inside(*surroundings.region, frames.back().p)) {
        found = Obstacle::kRegion;
      } else if (surroundings.tracker) {
        found = beam_obstacle(surroundings, *surroundings.tracker, frames, robot.joint_count());
      }
    }
  });
  return out;
}

}  // namespace fastcal::design
