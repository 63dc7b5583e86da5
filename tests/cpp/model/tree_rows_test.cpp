// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Trees in many rows side by side against the same row by row, and that against differences: from any frame any other.
#include <gtest/gtest.h>

#include "fastcal/model/prediction.hpp"
#include "fastcal/model/row_block.hpp"
#include "support/trees.hpp"

namespace fastcal {
namespace {

using test::Random;
using Motion6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Any twist of any frame, so that exp(xi) is tested at any size.
class FreeTwists : public LinearEffect {
 public:
  explicit FreeTwists(const RobotModel& robot) {
    for (int f = 0; f < robot.frame_count(); ++f) {
      for (int k = 0; k < 6; ++k) parameters_.push_back({robot.frame_name(f), "xi", "m", 1e-3, "a twist"});
    }
  }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void basis(const State&, TwistColumns& columns) const override {
    for (int k = 0; k < static_cast<int>(parameters_.size()); ++k) columns.push_back({k, k / 6, Vector6d::Unit(k % 6)});
  }

 private:
  std::vector<Parameter> parameters_;
};

std::vector<View> views(const RobotModel& robot) {
  const int target = robot.tree().frame("target"), camera = robot.tree().frame("camera");
  return {{target, kWorldFrame}, {target, camera}, {camera, target}, {robot.view().target, target}};
}

Samples random_samples(Random& random, Eigen::Index rows, int joints) {
  Samples samples;
  samples.q = RowMatrixXd::NullaryExpr(rows, joints, [&] { return random.uniform(-3, 3); });
  return samples;
}

TEST(TreeRows, JacobiansOfAnyViewAreThoseOfDifferences) {
  Random random(1);
  for (int trial = 0; trial < test::repeat(10); ++trial) {
    const RobotModel robot = join(test::random_members(random, 4));
    const ErrorModel model(robot, {std::make_shared<FreeTwists>(robot)});
    const Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.3);
    const Samples samples = random_samples(random, 1, robot.joint_count());
    for (const View& view : views(robot)) {
      Motion6 J(6, model.parameter_count());
      const Pose T = RowEvaluator(model, theta).jacobian(samples.row(0), view, J);
      constexpr double h = 1e-3;
      for (int k = 0; k < model.parameter_count(); k += 3) {
        Eigen::Vector3d dp = Eigen::Vector3d::Zero();
        Eigen::Matrix3d dR = Eigen::Matrix3d::Zero();
        for (const auto& [step, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
          RowEvaluator there(model, theta + step * h * Eigen::VectorXd::Unit(model.parameter_count(), k));
          const Pose moved = seen(view, there.frames(samples.row(0)));
          dp += weight / (12 * h) * moved.p;
          dR += weight / (12 * h) * moved.R;
        }
        const Eigen::Matrix3d W = dR * T.R.transpose();
        Vector6d wanted;
        wanted << dp, (W(2, 1) - W(1, 2)) / 2, (W(0, 2) - W(2, 0)) / 2, (W(1, 0) - W(0, 1)) / 2;
        ASSERT_LT((J.col(k) - wanted).norm(), 1e-7 * wanted.norm() + 1e-9)
            << model.parameters()[static_cast<std::size_t>(k)].owner;
      }
    }
  }
}

TEST(TreeRows, RowsSideBySideAreThoseOneByOne) {
  Random random(2);
  for (int trial = 0; trial < test::repeat(10); ++trial) {
    const RobotModel robot = join(test::random_members(random, 4));
    for (const bool bare : {true, false}) {
      std::vector<std::shared_ptr<const Effect>> effects;
      if (!bare) effects.push_back(std::make_shared<FreeTwists>(robot));
      const ErrorModel model(robot, effects);
      const int p = model.parameter_count();
      const Eigen::VectorXd theta = model.start() + random.values(p, 0.3);
      const Eigen::Index rows = 37;
      const Samples samples = random_samples(random, rows, robot.joint_count());
      RowEvaluator one(model, theta);
      for (const View& view : views(robot)) {
        std::vector<double> poses(static_cast<std::size_t>(16 * rows)), J(static_cast<std::size_t>(6 * rows * p));
        predict(model, samples, theta, view, 1, poses.data());
        parameter_jacobian(model, samples, theta, view, 6, 1, J.data());
        Motion6 wanted(6, p);
        for (Eigen::Index i = 0; i < rows; ++i) {
          const Pose T = one.jacobian(samples.row(i), view, wanted);
          const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> found(poses.data() + 16 * i);
          ASSERT_LT((found.topLeftCorner<3, 3>() - T.R).norm() + (found.topRightCorner<3, 1>() - T.p).norm(), 1e-12);
          const Eigen::Map<const RowMatrixXd> J_i(J.data() + i * 6 * p, 6, p);
          ASSERT_LT((J_i - wanted).norm(), 1e-12 * (1 + wanted.norm()));
        }
      }
    }
  }
}

/// Numbers of which each looks at two frames, as a fit asks for them.
TEST(TreeRows, ColumnsOfNumbersThatLookAtTwoFramesAreThoseOneByOne) {
  Random random(3);
  for (int trial = 0; trial < test::repeat(10); ++trial) {
    const RobotModel robot = join(test::random_members(random, 4));
    const ErrorModel model(robot, {std::make_shared<FreeTwists>(robot)});
    const int p = model.parameter_count();
    const Eigen::VectorXd theta = model.start() + random.values(p, 0.3);
    const Eigen::Index rows = 21;
    const Samples samples = random_samples(random, rows, robot.joint_count());
    std::vector<int> free(static_cast<std::size_t>(p));
    for (int k = 0; k < p; ++k) free[static_cast<std::size_t>(k)] = k;
    RowBlock block(model, theta, free, Eigen::VectorXd::Ones(p));
    block.forward(samples, 0, rows, nullptr);
    const int stride = block.stride();
    const int frames[2] = {robot.tree().frame("target"), robot.tree().frame("camera")};
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(6 * 2 * 6 * stride);
    std::vector<kernels::Sight> sights;
    for (int n = 0; n < 6; ++n) {
      for (int s = 0; s < 2; ++s) {
        double* of = slope.data() + (2 * n + s) * 6 * stride;
        std::fill(of + n * stride, of + (n + 1) * stride, s == 0 ? 1.0 : -2.0);
        sights.push_back({n, frames[s], of});
      }
    }
    const std::vector<double> factor(static_cast<std::size_t>(6 * stride), 1.0);
    const int ld = 6 * stride;
    Eigen::MatrixXd found(ld, p);
    block.jacobian({kernels::ToolNumbers::kNone, 6, factor.data(), sights.data(), 12}, found.data(), ld);
    RowEvaluator one(model, theta);
    Motion6 first(6, p), second(6, p);
    for (Eigen::Index i = 0; i < rows; ++i) {
      one.columns(samples.row(i));
      one.motion(frames[0], first);
      one.motion(frames[1], second);
      for (int n = 0; n < 6; ++n) {
        for (int k = 0; k < p; ++k) {
          const double wanted = first(n, k) - 2 * second(n, k);
          ASSERT_NEAR(found(n * stride + i, k), wanted, 1e-12 * (1 + std::abs(wanted)));
        }
      }
    }
  }
}

}  // namespace
}  // namespace fastcal
