// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// The settled arm is where its potential energy is least: elastic energy of the joints, heights of all weights, the
// compensator's spring. The minimum is found here by Newton's method on that energy alone, with numeric derivatives;
// nothing of statics.cpp is used.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>

#include "effects/loaded.hpp"
#include "fastcal/model/settle.hpp"
#include "support/robots.hpp"

namespace fastcal::test {
namespace {

struct Arm {
  RobotModel robot;
  Eigen::VectorXd compliance;  // one a joint
  double payload;
};

/// Energy [J] of the arm at commanded q whose joints give by `turn`.
double energy(const Arm& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& turn) {
  const RobotDescription& description = arm.robot.description();
  const Chain chain = arm.robot.chain();
  const Eigen::VectorXd there = q + turn;
  std::vector<Pose> frames;
  forward(chain, there.data(), nullptr, frames);
  double out = 0.5 * (turn.array().square() / arm.compliance.array()).sum();
  for (int i = 0; i < chain.joint_count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector3d centre =
        frames[static_cast<std::size_t>(joint_frame(i))] * (chain.body_frames[k] * description.bodies[k].com);
    out -= description.bodies[k].mass * description.gravity.dot(centre);
  }
  out -= arm.payload * description.gravity.dot(frames[frames.size() - 2] * description.p_flange_payload);
  if (description.compensator) {
    // Anchor and arm in the joint's frame at joint position 0: the arm is turned about (or moved along) z, the anchor
    // is not.
    const Compensator& spring = *description.compensator;
    Eigen::Vector3d end = spring.arm;
    if (description.joint_types[static_cast<std::size_t>(spring.joint)] == JointType::kRevolute) {
      end = Eigen::AngleAxisd(there[spring.joint], Eigen::Vector3d::UnitZ()) * end;
    } else {
      end.z() += there[spring.joint];
    }
    const double stretch = (spring.anchor - end).norm() - spring.free_length;
    out += 0.5 * spring.stiffness * stretch * stretch;
  }
  return out;
}

/// First derivative of f at 0 to eighth order.
double slope(const std::function<double(double)>& f) {
  constexpr double h = 2e-2;
  constexpr double c[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  double sum = 0;
  for (int k = 1; k <= 4; ++k) sum += c[k - 1] * (f(k * h) - f(-k * h));
  return sum / h;
}

Eigen::VectorXd gradient(const Arm& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& turn) {
  return Eigen::VectorXd::NullaryExpr(q.size(), [&](Eigen::Index j) {
    // The elastic part is known; only the rest needs differences, without the large numbers of stiff joints.
    const auto rest = [&](double step) {
      Eigen::VectorXd moved = turn;
      moved[j] += step;
      Arm bare = arm;
      bare.compliance.setConstant(1e300);
      return energy(bare, q, moved);
    };
    return turn[j] / arm.compliance[j] + slope(rest);
  });
}

Eigen::VectorXd least_energy(const Arm& arm, const Eigen::VectorXd& q) {
  Eigen::VectorXd turn = Eigen::VectorXd::Zero(q.size());
  for (int round = 0; round < 30; ++round) {
    const Eigen::VectorXd g = gradient(arm, q, turn);
    Eigen::MatrixXd H(q.size(), q.size());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      Eigen::VectorXd moved = turn;
      moved[j] += 1e-4;
      H.col(j) = (gradient(arm, q, moved) - g) / 1e-4;
    }
    const Eigen::VectorXd step = H.partialPivLu().solve(g);
    turn -= step;
    if (step.cwiseAbs().maxCoeff() < 1e-14) break;
  }
  return turn;
}

TEST(Equilibrium, IsWhereThePotentialEnergyIsLeast) {
  Random random(23);
  for (int repeat_index = 0; repeat_index < repeat(20); ++repeat_index) {
    const int n = random.whole(2, 6);
    Tables tables = random_tables(random, n);
    tables.base = Pose();
    const RobotModel bare = build("dh", tables);
    RobotDescription description = bare.description();
    for (Body& body : description.bodies) {
      body.mass = random.uniform(5, 80);
      body.com = random.vector(0.4);
    }
    description.p_flange_payload = random.vector(0.3);
    description.gravity = 9.8 * random.unit();
    if (random.chance(0.5))
      description.compensator = Compensator{random.whole(0, n - 1), random.vector(0.5), random.vector(0.5), 3000, 0.2};
    Arm arm{build_dh(description, tables.rows), Eigen::VectorXd(n), random.uniform(0, 50)};
    std::vector<Cause> causes;
    for (int j = 0; j < n; ++j) {
      arm.compliance[j] = random.uniform(1e-6, 2e-5);
      causes.push_back({"joint_compliance", "joint" + std::to_string(j + 1), {arm.compliance[j]}, {}});
    }
    const Eigen::VectorXd q = random.values(n, 1.5);
    const Twists xi = twists(with(arm.robot, causes), posture({q.data(), q.data() + n}, arm.payload));
    const Eigen::VectorXd expected = least_energy(arm, q);
    for (int j = 0; j < n; ++j) {
      const bool revolute = description.joint_types[static_cast<std::size_t>(j)] == JointType::kRevolute;
      EXPECT_NEAR(xi(revolute ? 5 : 2, joint_frame(j)), expected[j],
                  1e-9 * std::max(1e-3, expected.cwiseAbs().maxCoeff()))
          << "arm " << repeat_index;
    }
    // To first order it is somewhere else, by more than the tolerance above.
    const Twists first =
        twists(with(arm.robot, causes).with_equilibrium(false), posture({q.data(), q.data() + n}, arm.payload));
    EXPECT_GT((first - xi).norm(), 1e-7);
  }
}

// Effects that look at no load are asked once a row, not once a round: frames must be those of all effects at the end.
TEST(Equilibrium, HoldsWhatLoadsDoNotMove) {
  Random random(31);
  const int n = 4;
  Tables tables = random_tables(random, n);
  RobotDescription description = build("dh", tables).description();
  for (Body& body : description.bodies) {
    body.mass = random.uniform(5, 80);
    body.com = random.vector(0.4);
  }
  const RobotModel robot = build_dh(description, tables.rows);
  const std::vector<Cause> steady = {{"reduction_ratio", "joint2", {0.02}, {}},
                                     {"reduction_ratio", "joint3", {0.01}, {}}};
  std::vector<Cause> all = steady;
  for (int j = 0; j < n; ++j) all.push_back({"joint_compliance", "joint" + std::to_string(j + 1), {1e-5}, {}});
  const ErrorModel model = with(robot, all);
  Samples samples;
  samples.q = RowMatrixXd::NullaryExpr(20, n, [&] { return random.uniform(-1.5, 1.5); });
  EXPECT_LT(settle(model, model.start(), 1, samples), 1e-13);
  RowEvaluator rows(model, model.start());
  for (Eigen::Index i = 0; i < samples.count(); ++i) {
    const std::vector<Pose>& T = rows.frames(samples.row(i));
    for (std::size_t f = 0; f < T.size(); ++f) {
      const Pose& kept = samples.frames[static_cast<std::size_t>(i) * T.size() + f];
      ASSERT_LT((kept.p - T[f].p).norm() + (kept.R - T[f].R).norm(), 1e-12) << "row " << i << ", frame " << f;
    }
  }
}

/// Poses (N, 16) of the tool.
RowMatrixXd poses(const ErrorModel& model, const Samples& samples) {
  RowMatrixXd out(samples.count(), 16);
  predict(model, samples, model.start(), 1, out.data());
  return out;
}

/// A frame moved by a column of the data.
Cause moved_by_column(const std::string& frame, const std::string& axis, const std::vector<double>& values) {
  return {"regressor", frame, values, {{"column", std::string("given")}, {"axis", axis}}};
}

/// An arm, upright or not, with weights, some of them identified, springs in its joints, and effects that look at no
/// load. Its links are the same in all rows where no joint slides and its base is not moved.
struct SpringArm {
  RobotModel robot;
  std::vector<Cause> causes;
};

SpringArm spring_arm(Random& random, int n, double compliance) {
  Tables tables = random_tables(random, n);
  if (random.chance(0.7)) tables.types.assign(tables.types.size(), JointType::kRevolute);
  RobotDescription description = build("dh", tables).description();
  if (random.chance(0.3)) description.gravity = 9.8 * random.unit();
  for (Body& body : description.bodies) {
    if (random.chance(0.2)) continue;  // weightless
    body.mass = random.uniform(5, 80);
    body.com = random.vector(0.4);
  }
  description.p_flange_payload = random.vector(0.3);
  SpringArm out{build_dh(description, tables.rows), {}};
  if (random.chance(0.3)) out.causes.push_back(moved_by_column("base", "all", {1, 2, -1, 3, 2, 1}));
  for (int j = 0; j < n; ++j) {
    const std::string joint = "joint" + std::to_string(j + 1);
    if (random.chance(0.5)) out.causes.push_back({"reduction_ratio", joint, {random.uniform(-0.01, 0.01)}, {}});
    if (j == 0 || random.chance(0.8))
      out.causes.push_back({"joint_compliance", joint, {random.uniform(0, compliance)}, {}});
    const std::string link = "link" + std::to_string(j + 1);
    const Eigen::Vector3d moment = random.vector(2);
    if (random.chance(0.3)) out.causes.push_back({"link_mass", link, {random.uniform(-2, 5)}, {}});
    if (random.chance(0.3)) out.causes.push_back({"link_com", link, {moment[0], moment[1], moment[2]}, {}});
  }
  const Eigen::Vector3d shift = random.vector(0.05);
  if (random.chance(0.3)) out.causes.push_back({"payload_mass", "payload", {random.uniform(-1, 3)}, {}});
  if (random.chance(0.3)) out.causes.push_back({"payload_com", "payload", {shift[0], shift[1], shift[2]}, {}});
  return out;
}

Samples spring_rows(Random& random, int n) {
  Samples out;
  out.q = RowMatrixXd::NullaryExpr(140, n, [&] { return random.uniform(-2, 2); });
  out.payload = Eigen::VectorXd::NullaryExpr(140, [&] { return random.chance(0.3) ? 0 : random.uniform(1, 40); });
  out.extra = RowMatrixXd::NullaryExpr(140, 1, [&] { return random.uniform(-1e-2, 1e-2); });
  return out;
}

// Where springs and weights alone decide, the equilibrium is found for rows side by side: it is the one that the rounds
// of settle() come to, which an effect of size 0 that looks at loads asks for.
TEST(Equilibrium, OfSpringsIsThatOfTheRounds) {
  Random random(37);
  for (int repeat_index = 0; repeat_index < repeat(60); ++repeat_index) {
    const int n = random.whole(1, 8);
    const SpringArm arm = spring_arm(random, n, random.chance(0.5) ? 1e-5 : 1e-7);
    const ErrorModel springs = with(arm.robot, arm.causes);
    std::vector<Cause> more = arm.causes;
    more.push_back({"bearing_tilt", "joint1", {0}, {}});
    const ErrorModel rounds = with(arm.robot, more);
    Samples samples = spring_rows(random, n);
    if (random.chance(0.3)) samples.payload.resize(0, 0);
    const RowMatrixXd expected = poses(rounds, samples);
    ASSERT_TRUE(expected.allFinite());
    EXPECT_LT((poses(springs, samples) - expected).cwiseAbs().maxCoeff(), 1e-12) << "arm " << repeat_index;

    Samples by_springs = samples, by_rounds = samples;
    EXPECT_LT(settle(springs, springs.start(), 2, by_springs), 1e-13);
    settle(rounds, rounds.start(), 1, by_rounds);
    const double largest = std::max(1.0, by_rounds.load.cwiseAbs().maxCoeff());
    EXPECT_LT((by_springs.load - by_rounds.load).cwiseAbs().maxCoeff(), 1e-11 * largest);
    EXPECT_LT((by_springs.payload_load - by_rounds.payload_load).cwiseAbs().maxCoeff(), 1e-11 * largest);

    // A row is the same wherever in a batch it stands.
    const Samples one = samples.slice(133, 134);
    EXPECT_EQ((poses(springs, one) - poses(springs, samples).row(133)).norm(), 0);
  }
}

// What springs and weights do not decide alone is left to the rounds: wrenches, joints that also tilt, loads taken in
// the undeflected posture, and arms too soft to stand.
TEST(Equilibrium, OfMoreThanSpringsIsLeftToTheRounds) {
  Random random(41);
  const int n = 4;
  const SpringArm arm = spring_arm(random, n, 1e-5);
  std::vector<Cause> with_zero = arm.causes;
  with_zero.push_back({"bearing_tilt", "joint2", {0}, {}});
  Samples samples = spring_rows(random, n);
  const auto expect_same = [&](const std::vector<Cause>& causes, const std::vector<Cause>& more, bool at_equilibrium) {
    const RowMatrixXd expected = poses(with(arm.robot, more).with_equilibrium(at_equilibrium), samples);
    EXPECT_LT((poses(with(arm.robot, causes).with_equilibrium(at_equilibrium), samples) - expected).norm(), 1e-11);
  };
  expect_same(arm.causes, with_zero, false);
  samples.wrench = RowMatrixXd::Random(samples.count(), 6) * 100;
  expect_same(arm.causes, with_zero, true);
  samples.wrench.resize(0, 0);
  std::vector<Cause> tilted = arm.causes, tilted_with_zero = with_zero;
  for (int j = 1; j <= n; ++j) {
    const Cause tilt = moved_by_column("joint" + std::to_string(j), "rx", {1});
    tilted.push_back(tilt);
    tilted_with_zero.push_back(tilt);
  }
  expect_same(tilted, tilted_with_zero, true);

  std::vector<Cause> soft;
  for (int j = 0; j < n; ++j) soft.push_back({"joint_compliance", "joint" + std::to_string(j + 1), {0.1}, {}});
  EXPECT_TRUE(poses(with(arm.robot, soft), samples).allFinite());
}

}  // namespace
}  // namespace fastcal::test
