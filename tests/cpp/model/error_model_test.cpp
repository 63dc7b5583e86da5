// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/model/error_model.hpp"

#include <gtest/gtest.h>

#include "fastcal/math/check.hpp"
#include "fastcal/model/prediction.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

using test::Random;

/// Any twist of any frame: six parameters a frame, so that a chain's exp(xi) is tested at any size.
class FreeTwists : public LinearEffect {
 public:
  explicit FreeTwists(const RobotModel& robot) {
    for (int f = 0; f < robot.frame_count(); ++f) {
      for (int k = 0; k < 6; ++k)
        parameters_.push_back({robot.frame_name(f), "xi" + std::to_string(k), k < 3 ? "m" : "rad", 1e-3, "a twist"});
    }
  }
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void basis(const State&, TwistColumns& columns) const override {
    for (int k = 0; k < static_cast<int>(parameters_.size()); ++k) columns.push_back({k, k / 6, Vector6d::Unit(k % 6)});
  }

 private:
  std::vector<Parameter> parameters_;
};

Samples random_samples(Random& random, Eigen::Index rows, int joints) {
  Samples samples;
  samples.q = RowMatrixXd::NullaryExpr(rows, joints, [&] { return random.uniform(-3, 3); });
  return samples;
}

/// Two effects on the same frames add up before the exponential: their order can't matter.
TEST(ErrorModel, TwistsOfSeveralEffectsAddUpAndTheirJacobianIsExactAtAnySize) {
  Random random(1);
  for (int trial = 0; trial < test::repeat(50); ++trial) {
    const RobotModel robot =
        test::build(test::kKinds4[static_cast<std::size_t>(trial % 4)], test::random_tables(random, 3));
    const auto effect = std::make_shared<FreeTwists>(robot);
    const ErrorModel model(robot, {effect, effect});
    const Samples samples = random_samples(random, 1, 3);
    const Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.7);
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.parameter_count());
    const Pose T = RowEvaluator(model, theta).jacobian(samples.row(0), J);
    constexpr double h = 1e-3;
    for (int k = 0; k < model.parameter_count(); ++k) {
      Eigen::Vector3d dp = Eigen::Vector3d::Zero();
      Eigen::Matrix3d dR = Eigen::Matrix3d::Zero();
      for (const auto& [step, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
        const Pose moved = RowEvaluator(model, theta + step * h * Eigen::VectorXd::Unit(model.parameter_count(), k))
                               .pose(samples.row(0));
        dp += weight / (12 * h) * moved.p;
        dR += weight / (12 * h) * moved.R;
      }
      const Eigen::Matrix3d W = dR * T.R.transpose();
      Vector6d wanted;
      wanted << dp, (W(2, 1) - W(1, 2)) / 2, (W(0, 2) - W(2, 0)) / 2, (W(1, 0) - W(0, 1)) / 2;
      EXPECT_LT((J.col(k) - wanted).norm(), 1e-7 * wanted.norm() + 1e-10)
          << model.parameters()[static_cast<std::size_t>(k)].owner;
    }
    const Eigen::Index twists = effect->parameters().size();
    Eigen::VectorXd swapped = theta;
    swapped.segment(theta.size() - 2 * twists, twists) = theta.tail(twists);
    swapped.tail(twists) = theta.segment(theta.size() - 2 * twists, twists);
    const Pose other = RowEvaluator(model, swapped).pose(samples.row(0));
    EXPECT_LT((other.p - T.p).norm(), 1e-13);
  }
}

TEST(ErrorModel, ZeroTwistsAreTheNominalRobotBitForBit) {
  Random random(2);
  const RobotModel robot = test::build("urdf", test::random_tables(random, 6));
  const ErrorModel bare(robot);
  const ErrorModel with(robot, {std::make_shared<FreeTwists>(robot)});
  const Samples samples = random_samples(random, 1, 6);
  const Pose a = RowEvaluator(bare, bare.start()).pose(samples.row(0));
  const Pose b = RowEvaluator(with, with.start()).pose(samples.row(0));
  EXPECT_EQ(a.p, b.p);
  EXPECT_EQ(a.R, b.R);
}

TEST(ErrorModel, BatchesAreTheRowsWhateverTheThreads) {
  Random random(3);
  const RobotModel robot = test::build("mdh", test::random_tables(random, 5));
  const ErrorModel model(robot, {std::make_shared<FreeTwists>(robot)});
  const Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.1);
  const Samples samples = random_samples(random, 1100, 5);  // more than four chunks, the last not full
  const int p = model.parameter_count();
  std::vector<double> poses(16 * 1100);
  std::vector<double> J(static_cast<std::size_t>(6 * 1100 * p));
  predict(model, samples, theta, 1, poses.data());
  parameter_jacobian(model, samples, theta, 6, 1, J.data());
  for (const int threads : {2, 5, 100}) {
    std::vector<double> again(poses.size());
    std::vector<double> J_again(J.size());
    predict(model, samples, theta, threads, again.data());
    parameter_jacobian(model, samples, theta, 6, threads, J_again.data());
    EXPECT_EQ(poses, again);
    EXPECT_EQ(J, J_again);
  }
  std::vector<double> J_position(J.size() / 2);
  parameter_jacobian(model, samples, theta, 3, 1, J_position.data());
  RowEvaluator rows(model, theta);
  Eigen::Matrix<double, 6, Eigen::Dynamic> one(6, p);
  for (const Eigen::Index i : {0, 255, 256, 1099}) {
    const Pose& T = rows.jacobian(samples.row(i), one);
    const auto pose = Eigen::Map<const RowMatrixXd>(&poses[static_cast<std::size_t>(16 * i)], 4, 4);
    EXPECT_LT((pose.topLeftCorner<3, 3>() - T.R).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LT((pose.topRightCorner<3, 1>() - T.p).cwiseAbs().maxCoeff(), 1e-13);
    const auto whole = Eigen::Map<const RowMatrixXd>(&J[static_cast<std::size_t>(6 * i * p)], 6, p);
    EXPECT_LT((whole - one).cwiseAbs().maxCoeff(), 1e-13);
    const auto top = Eigen::Map<const RowMatrixXd>(&J_position[static_cast<std::size_t>(3 * i * p)], 3, p);
    EXPECT_EQ(top, whole.topRows(3));
  }
  predict(model, random_samples(random, 0, 5), theta, 2, nullptr);
}

template <typename F>
std::string refusal(const F& f) {
  try {
    f();
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "nothing was refused";
}

TEST(ErrorModel, BadShapesAreRefusedInASentence) {
  Random random(4);
  const ErrorModel model(test::build("dh", test::random_tables(random, 3)));
  double out[16];
  Samples samples = random_samples(random, 1, 4);
  EXPECT_EQ(refusal([&] { predict(model, samples, model.start(), 1, out); }), "q must have shape (N, 3), got (1, 4)");
  samples = random_samples(random, 1, 3);
  EXPECT_EQ(refusal([&] { predict(model, samples, model.start().head(5), 1, out); }),
            "the model has 27 parameters, got 5");
  EXPECT_EQ(refusal([&] { parameter_jacobian(model, samples, model.start(), 4, 1, out); }),
            "a parameter Jacobian has 3 or 6 rows a sample, got 4");
  EXPECT_EQ(refusal([&] { ErrorModel(model.robot(), {}, Eigen::VectorXd::Ones(2)); }),
            "the effects have 0 parameters, got 2 values");
  samples.payload = Eigen::VectorXd::Zero(2);
  EXPECT_EQ(refusal([&] { predict(model, samples, model.start(), 1, out); }), "payload must have shape (1,), got (2,)");
  samples.payload.resize(0, 0);
  samples.q.own()(0, 1) = std::nan("");
  EXPECT_EQ(refusal([&] { predict(model, samples, model.start(), 1, out); }), "q must be finite");
}

}  // namespace
}  // namespace fastcal
