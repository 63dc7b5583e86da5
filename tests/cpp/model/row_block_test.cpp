// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows side by side against RowEvaluator, which takes them one by one.
#include "fastcal/model/row_block.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "fastcal/kernels/streams.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/math/se3.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

using test::Random;

/// Turns and shifts that differ from row to row, and rows in which there are none.
class RowTwists : public LinearEffect {
 public:
  explicit RowTwists(bool turns_only) : turns_only_(turns_only) {}
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void basis(const State& state, TwistColumns& columns) const override {
    const double q = state.q[0];
    Vector6d turn = Vector6d::Zero();
    turn[5] = q;
    if (q > -2) columns.push_back({0, joint_frame(1), turn});
    Vector6d twist;
    twist << 1, q, q * q, 0.3, std::sin(q), 1;
    columns.push_back({1, turns_only_ ? joint_frame(1) : link_frame(0), turns_only_ ? turn : twist});
    if (q > 0) columns.push_back({1, kBaseFrame, turns_only_ ? turn : twist});
    if (q < 1) columns.push_back({2, tool_frame(3), twist});
  }

 private:
  bool turns_only_;
  std::vector<Parameter> parameters_{
      {"rows", "a", "m", 1, "one"}, {"rows", "b", "m", 1, "two"}, {"rows", "c", "m", 1, "three"}};
};

/// The same, not linear: asked for its columns at every theta.
class Bent : public Effect {
 public:
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void deflect(const State& state, const double* theta, Twists& xi, TwistColumns* columns) const override {
    const Vector6d along = state.q[1] * Vector6d::Ones();
    xi.col(link_frame(1)) += theta[0] * theta[0] * along;
    if (columns != nullptr) columns->push_back({0, link_frame(1), 2 * theta[0] * along});
  }

 private:
  std::vector<Parameter> parameters_{{"bent", "a", "m", 1, "squared"}};
};

/// Linear, of so many columns that their sum alone is asked for where nobody wants them.
class ManyTwists : public LinearEffect {
 public:
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void basis(const State& state, TwistColumns& columns) const override {
    for (int k = 0; k < 40; ++k)
      columns.push_back({k, k % 2 == 0 ? joint_frame(1) : link_frame(1), std::sin(k + state.q[1]) * Vector6d::Unit(5)});
  }

 private:
  std::vector<Parameter> parameters_ = std::vector<Parameter>(40, {"many", "a", "rad", 1, "a wave"});
};

/// Moves nothing, turns a joint about its axis, tilts two, or does that and moves a link, as axis 2 stands.
class Sometimes : public LinearEffect {
 public:
  const std::vector<Parameter>& parameters() const override { return parameters_; }
  void basis(const State& state, TwistColumns& columns) const override {
    if (state.q[1] < 0) columns.push_back({1, joint_frame(1), Vector6d::Unit(5)});
    for (int j = 0; j < 2 && state.q[1] >= 1; ++j) columns.push_back({0, joint_frame(j), Vector6d::Ones()});
    if (state.q[1] >= 2) columns.push_back({1, link_frame(1), 2 * Vector6d::Ones()});
  }

 private:
  std::vector<Parameter> parameters_{{"some", "a", "m", 1, "one"}, {"some", "b", "m", 1, "two"}};
};

int robot_tool(const ErrorModel& model) { return tool_frame(model.robot().joint_count()); }

/// The tool's position as coordinates, and all six parts of the motion of a frame: of another frame, less that of the
/// tool, which is a number that looks at two frames.
struct Numbers {
  Numbers(int stride, int tool, int other) : factor(9 * stride, 1.0), slope(Eigen::VectorXd::Zero(12 * 6 * stride)) {
    for (int o = 0; o < 6; ++o) {
      for (int s = 0; s < 2; ++s) {
        const Eigen::Index first = (2 * o + s) * 6 * stride;
        slope.segment(first + o * stride, stride).setConstant(s == 0 ? 1.0 : -1.0);
        sights.push_back({3 + o, s == 0 ? other : tool, slope.data() + first});
      }
    }
  }
  std::vector<double> factor;
  Eigen::VectorXd slope;
  std::vector<kernels::Sight> sights;
  kernels::NumberRows rows() const { return {kernels::ToolNumbers::kPosition, 6, factor.data(), sights.data(), 12}; }
};

void expect_rows(const ErrorModel& model, const Samples& samples, const Eigen::VectorXd& theta, TwistMemory* memory) {
  const int p = model.parameter_count();
  std::vector<int> free;  // every other one, backwards, and one that is not the model's
  for (int k = p - 1; k >= 0; k -= 2) free.push_back(k);
  free.push_back(p);
  const auto columns = static_cast<Eigen::Index>(free.size());
  const Eigen::VectorXd scale = Eigen::VectorXd::LinSpaced(columns, 1, 2);
  RowBlock block(model, theta, free, scale);
  RowEvaluator rows(model, theta);
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, p);
  for (Eigen::Index begin = 0; begin < samples.count(); begin += kChunkRows) {
    const Eigen::Index end = std::min(begin + kChunkRows, samples.count());
    block.forward(samples, begin, end, memory);
    const int other = 1 + static_cast<int>(begin / kChunkRows % 4);  // joint, link, ... of the first joints
    const Numbers numbers(block.stride(), robot_tool(model), other);
    const int ld = 9 * block.stride() + 3;
    Eigen::MatrixXd found(ld, columns);
    block.jacobian(numbers.rows(), found.data(), ld);
    Eigen::MatrixXd points(ld, columns);
    block.jacobian({kernels::ToolNumbers::kPosition, 0, numbers.factor.data(), nullptr, 0}, points.data(), ld);
    std::vector<double> poses(static_cast<std::size_t>(6 * columns * (end - begin)));
    block.write_jacobian(robot_tool(model), kernels::ToolNumbers::kPose, false, poses.data());
    std::vector<double> positions(poses.size() / 2);
    block.write_jacobian(robot_tool(model), kernels::ToolNumbers::kPosition, true, positions.data());
    kernels::finish_copies();
    for (Eigen::Index i = 0; i < end - begin; ++i) {
      const Pose& T = rows.jacobian(samples.row(begin + i), J);
      const Pose at = block.frame(robot_tool(model), static_cast<int>(i));
      ASSERT_LT((at.p - T.p).norm() + (at.R - T.R).norm(), 1e-13) << "row " << begin + i;
      Eigen::Matrix<double, 6, Eigen::Dynamic> J_other(6, p);
      rows.motion(other, J_other);
      for (Eigen::Index k = 0; k + 1 < columns; ++k) {
        for (int c = 0; c < 9; ++c) {
          const int f = free[k];
          const double wanted = scale[k] * (c < 3 ? J(c, f) : J_other(c - 3, f) - J(c - 3, f));
          const Eigen::Index at_row = c * block.stride() + i;
          ASSERT_NEAR(found(at_row, k), wanted, 1e-12 * (1 + std::abs(wanted)))
              << "row " << begin + i << ", parameter " << free[static_cast<std::size_t>(k)] << ", component " << c;
          if (c < 3) {
            ASSERT_NEAR(points(at_row, k), wanted, 1e-12 * (1 + std::abs(wanted)));
            ASSERT_NEAR(positions[static_cast<std::size_t>((3 * i + c) * columns + k)], wanted,
                        1e-12 * (1 + std::abs(wanted)));
          }
          if (c < 6) {
            const double of_tool = scale[k] * J(c, f);
            ASSERT_NEAR(poses[static_cast<std::size_t>((6 * i + c) * columns + k)], of_tool,
                        1e-12 * (1 + std::abs(of_tool)));
          }
        }
      }
      for (int c = 0; c < 9; ++c) ASSERT_EQ(found(c * block.stride() + i, columns - 1), 0);
    }
  }
}

TEST(RowBlock, IsTheRowsOneByOne) {
  Random random(1);
  for (int trial = 0; trial < 12; ++trial) {
    const RobotModel robot =
        test::build(test::kKinds4[static_cast<std::size_t>(trial % 4)], test::random_tables(random, 3));
    std::vector<std::shared_ptr<const Effect>> effects;
    if (trial >= 4) effects.push_back(std::make_shared<RowTwists>(trial >= 8));
    if (trial % 3 == 1) effects.push_back(std::make_shared<Bent>());
    const ErrorModel model(robot, effects);
    Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.3);
    Samples samples;
    samples.q = RowMatrixXd::NullaryExpr(kChunkRows + 21, 3, [&] { return random.uniform(-3, 3); });
    TwistMemory memory;
    memory.prepare(samples.count());
    expect_rows(model, samples, theta, nullptr);
    expect_rows(model, samples, theta, &memory);  // fills it,
    theta.tail(2).setZero();
    expect_rows(model, samples, theta, &memory);  // uses it
  }
}

TEST(RowBlock, LooksAgainWhereAnEffectBeginsToMoveAFrame) {
  Random random(4);
  const RobotModel robot = test::build("dh", test::random_tables(random, 3));
  const ErrorModel model(robot, {std::make_shared<Sometimes>()});
  const Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.3);
  Samples samples;
  const std::vector<double> stands{0, 1, 0, -1, 2, 0, 2};  // of axis 2, by chunk
  RowMatrixXd q = RowMatrixXd::NullaryExpr(7 * kChunkRows, 3, [&] { return random.uniform(-3, 3); });
  for (Eigen::Index i = 0; i < q.rows(); ++i) q(i, 1) = stands[static_cast<std::size_t>(i / kChunkRows)];
  samples.q = q;
  expect_rows(model, samples, theta, nullptr);
}

TEST(RowBlock, PosesAreTheRowsWhereNobodyWantsTheColumns) {
  Random random(5);
  const RobotModel robot = test::build("dh", test::random_tables(random, 3));
  const ErrorModel model(robot, {std::make_shared<RowTwists>(false), std::make_shared<ManyTwists>(),
                                 std::make_shared<Bent>(), std::make_shared<ManyTwists>()});
  const Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.3);
  Samples samples;
  samples.q = RowMatrixXd::NullaryExpr(kChunkRows + 21, 3, [&] { return random.uniform(-3, 3); });
  RowBlock all(model, theta, {}, {});
  RowBlock tool(model, theta, {}, {}, RowBlock::Frames::kTool);
  RowBlock none(model, theta, {}, {}, RowBlock::Frames::kNone);
  RowEvaluator rows(model, theta);
  for (Eigen::Index begin = 0; begin < samples.count(); begin += kChunkRows) {
    const Eigen::Index end = std::min(begin + kChunkRows, samples.count());
    for (RowBlock* block : {&all, &tool, &none}) block->forward(samples, begin, end, nullptr);
    std::vector<double> matrices(static_cast<std::size_t>(16 * (end - begin)));
    none.write_seen(model.robot().view(), matrices.data());
    for (Eigen::Index i = begin; i < end; ++i) {
      const Pose T = rows.pose(samples.row(i));
      const auto row = static_cast<int>(i - begin);
      for (const RowBlock* block : {&all, &tool}) {
        const Pose at = block->frame(robot_tool(model), row);
        ASSERT_LT((at.p - T.p).norm() + (at.R - T.R).norm(), 1e-13) << "row " << i;
        ASSERT_EQ(block->position(row, 1), at.p[1]);
      }
      const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(matrices.data() + 16 * row);
      ASSERT_LT((matrix.topLeftCorner<3, 3>() - T.R).norm() + (matrix.topRightCorner<3, 1>() - T.p).norm(), 1e-13);
      ASSERT_EQ(matrix.row(3), Eigen::RowVector4d(0, 0, 0, 1));
    }
  }
}

TEST(RowBlock, RefusesAPositionThatIsNotFinite) {
  const ErrorModel model(test::build("dh", test::six_axes(0.7)));
  Samples samples;
  samples.q = RowMatrixXd::Zero(9, 6);
  RowBlock block(model, model.start(), {}, {});
  block.forward(samples, 0, 9, nullptr);
  for (const Eigen::Index row : {3, 8}) {  // among four, and behind the last four
    Samples wrong = samples;
    wrong.q.own()(row, 5) = std::nan("");
    EXPECT_THROW(block.forward(wrong, 0, 9, nullptr), InvalidInput);
  }
}

TEST(JointRows, LentNumbersAreReadWhereTheyLieAndCopiedToBeWritten) {
  const auto owner = std::make_shared<const RowMatrixXd>(RowMatrixXd::Random(5, 3));
  JointRows lent(owner->data(), 5, 3, owner);
  const JointRows copy = lent;
  EXPECT_EQ(copy.data(), owner->data());
  EXPECT_EQ(copy.table(), *owner);
  EXPECT_EQ(copy(4, 2), (*owner)(4, 2));
  EXPECT_EQ(owner.use_count(), 3);
  lent.own()(0, 0) = 7;
  EXPECT_NE((*owner)(0, 0), 7);
  EXPECT_EQ(lent(0, 0), 7);
  EXPECT_EQ(lent.table().bottomRows(4), owner->bottomRows(4));
  EXPECT_EQ(copy.table(), *owner);
}

// Which frame moves first: geometry moves those behind its place, an effect its own frame too.
TEST(RowEvaluator, MotionOfEveryFrameIsThatOfDifferences) {
  Random random(8);
  for (const auto& kind : test::kKinds4) {
    const ErrorModel model(test::build(kind, test::random_tables(random, 3)), {std::make_shared<RowTwists>(false)});
    const Eigen::VectorXd theta = model.start() + random.values(model.parameter_count(), 0.2);
    Samples samples;
    samples.q = RowMatrixXd::NullaryExpr(1, 3, [&] { return random.uniform(-0.9, 0.9); });
    RowEvaluator rows(model, theta);
    rows.columns(samples.row(0));
    constexpr double h = 1e-5;
    for (int frame = 0; frame <= robot_tool(model); ++frame) {
      Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.parameter_count());
      rows.motion(frame, J);
      for (int k = 0; k < model.parameter_count(); ++k) {
        const auto at = [&](double step) {
          Eigen::VectorXd there = theta;
          there[k] += step;
          return RowEvaluator(model, there).frames(samples.row(0))[frame];
        };
        const Pose ahead = at(h), behind = at(-h);
        Vector6d wanted;
        wanted << (ahead.p - behind.p) / (2 * h), log_so3(ahead.R * behind.R.transpose()) / (2 * h);
        ASSERT_LT((J.col(k) - wanted).norm(), 1e-7) << kind << ", frame " << frame << ", parameter " << k;
      }
    }
  }
}

TEST(RowBlock, HoldsAtAnglesBeyondThePolynomial) {
  const ErrorModel model(test::build("dh", test::six_axes(0.7)));
  Samples samples;
  samples.q = RowMatrixXd::Zero(2, 6);
  samples.q.own().topLeftCorner<2, 3>() << 1.5e7, -3e9, 0.1, 99999.5, -99999.5, 100000.5;
  RowBlock block(model, model.start(), {}, {});
  block.forward(samples, 0, 2, nullptr);
  RowEvaluator rows(model, model.start());
  for (int i = 0; i < 2; ++i) {
    const Pose& T = rows.pose(samples.row(i));
    EXPECT_LT((block.frame(robot_tool(model), i).p - T.p).norm() + (block.frame(robot_tool(model), i).R - T.R).norm(),
              1e-13);
  }
}

}  // namespace
}  // namespace fastcal
