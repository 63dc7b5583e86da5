// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Rows that are read part by part: the identification must be that of the same rows in memory, bit for bit.
#include "fastcal/identification/row_source.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "fastcal/identification/load_response.hpp"
#include "fastcal/identification/row_errors.hpp"
#include "fastcal/model/settle.hpp"
#include "identification/scene.hpp"
#include "identification/twisted_arm.hpp"

namespace fastcal::test {
namespace {

/// Rows of a scene, as if they came from a file.
class RowsOfScene : public RowSource {
 public:
  explicit RowsOfScene(const Scene& scene) : scene_(scene), measured_(scene.measured) {}

  Eigen::Index count() const override { return scene_.samples.count(); }
  SomeRows read(Eigen::Index begin, Eigen::Index end) const override {
    std::vector<Eigen::Index> rows(static_cast<std::size_t>(end - begin));
    std::iota(rows.begin(), rows.end(), begin);
    ++reads;
    return pick(rows);
  }
  SomeRows pick(const std::vector<Eigen::Index>& rows) const override {
    most = std::max(most, static_cast<Eigen::Index>(rows.size()));
    return {std::make_shared<Samples>(scene_.samples.pick(rows)), std::make_shared<Measurements>(measured_.pick(rows))};
  }

  mutable Eigen::Index reads = 0, most = 0;

 private:
  const Scene& scene_;
  Measurements measured_;
};

Identification read(const Scene& s, const RowsOfScene& rows, const std::vector<int>& asked,
                    const IdentifyOptions& options, int threads = 1) {
  const SomeRows few = rows.pick({0, rows.count() / 2, rows.count() - 1});
  return identify({s.model, *few.samples, *few.measured, threads, nullptr, nullptr, &rows}, asked, Eigen::VectorXd(),
                  options);
}

Identification read(const Scene& s, const RowsOfScene& rows, const IdentifyOptions& options, int threads = 1) {
  return read(s, rows, asked(s.model, s.what), options, threads);
}

void expect_same(const Identification& a, const Identification& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.theta, b.theta);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.free, b.free);
  EXPECT_EQ(a.outliers, b.outliers);
  EXPECT_EQ(a.tau, b.tau);
  EXPECT_EQ(a.sigma, b.sigma);
  EXPECT_EQ(a.variance_factor, b.variance_factor);
  EXPECT_EQ(a.degrees_of_freedom, b.degrees_of_freedom);
}

TEST(RowSource, RowsThatAreReadGiveTheBitsOfRowsInMemory) {
  Scene s = scene(61, What::kPositions, 40'000, {5e-5, 0});
  for (Eigen::Index i = 0; i < s.samples.count(); i += 50) s.measured.position(i, i % 3) += 4e-3;
  const RowsOfScene rows(s);
  for (const LossKind loss : {LossKind::kNone, LossKind::kTukey}) {
    const Identification result = read(s, rows, with(loss));
    ASSERT_EQ(result.status, Status::kConverged) << result.message;
    const Identification in_memory = s.identified(with(loss));
    expect_same(result, in_memory);
    // Of the three rows that stand beside the source.
    EXPECT_EQ(result.residuals.row(2), in_memory.residuals.row(rows.count() - 1));
    ASSERT_EQ(result.weights.size(), 3U);
    EXPECT_EQ(result.weights[1].weight, in_memory.weights[static_cast<std::size_t>(rows.count() / 2)].weight);
  }
  EXPECT_LT(rows.most, s.samples.count());
  expect_same(read(s, rows, {}, 3), s.identified());
}

TEST(RowSource, WhatRowsClaimAndLackIsReadWithThem) {
  Scene s = scene(62, What::kPoses, 32'000, {5e-5, 1e-4});
  Random random(63);
  s.measured.sigma_position =
      RowMatrixXd::NullaryExpr(s.samples.count(), 3, [&] { return random.uniform(1e-5, 1e-4); });
  for (Eigen::Index i = 0; i < s.samples.count(); i += 7) s.measured.position(i, i % 3) = kNan;
  for (Eigen::Index i = 0; i < s.samples.count(); i += 5) s.measured.rotation.row(i).setConstant(kNan);
  const RowsOfScene rows(s);
  const Identification result = read(s, rows, {});
  ASSERT_EQ(result.status, Status::kConverged) << result.message;
  expect_same(result, s.identified());
}

/// An arm whose upper link its load twists, and which is off by a tenth of a millimetre.
Scene twisted(Eigen::Index rows, double noise, const std::vector<int>& few) {
  Random random(66);
  Scene s{twisted_arm(), postures(random, rows, 6), {}, {}, What::kPositions};
  s.truth = s.model.start();
  for (const int parameter : few) s.truth[parameter] += 1e-4;
  Samples settled = s.samples;
  settle(s.model, s.truth, 1, settled);
  s.measured = measure(random, s.model, settled, s.truth, s.what, {noise, 0});
  return s;
}

std::vector<int> along_the_twist() {
  const ErrorModel model = twisted_arm();
  return {index_of(model, "joint2 d"), index_of(model, "joint3 d"), index_of(model, "joint2 a")};
}

TEST(RowSource, LoadsOfRowsThatAreReadFollowTheArm) {
  const std::vector<int> few = along_the_twist();
  const Scene s = twisted(1000, 2e-4, few);
  const RowsOfScene rows(s);
  const Identification result = read(s, rows, few, with(LossKind::kNone));
  const Identification in_memory =
      identify({s.model, s.samples, s.measured}, few, Eigen::VectorXd(), with(LossKind::kNone));
  ASSERT_EQ(result.status, Status::kConverged) << result.message;
  ASSERT_EQ(result.free, in_memory.free);
  EXPECT_EQ(result.free.size(), 3U);
  const Eigen::VectorXd deviation = in_memory.covariance.diagonal().cwiseSqrt();
  EXPECT_LT((result.theta(few) - in_memory.theta(few)).cwiseQuotient(deviation).norm(), 1e-4);
  EXPECT_LT((result.covariance - in_memory.covariance).norm(), 1e-4 * in_memory.covariance.norm());
}

// Two parts, and a direction that only the twist determines: without the loads' response there is next to no slope.
TEST(RowSource, EachPartHasTheLoadsOfTheWhole) {
  const std::vector<int> few = along_the_twist();
  const Scene s = twisted(31'000, 1e-3, few);
  const RowsOfScene rows(s);
  const Eigen::VectorXd theta = s.model.start();
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(3, 1e-3);
  const Weighting weighting{{1e-3}, LossKind::kNone};
  Samples settled = s.samples;
  settle(s.model, theta, 1, settled);
  Problem whole{s.model, settled, s.measured};
  const Eigen::MatrixXd factor = triangular_factor(whole, theta, few, scale, weighting);
  const auto response = load_response(whole, theta, few, scale, factor);
  ASSERT_TRUE(response);
  const Eigen::MatrixXd without = normal_equations(whole, theta, few, scale, weighting, true).A;
  whole.response = &*response;
  const SomeRows some = rows.pick({0, 1, 2});
  LoadResponse read = *response;
  read.change.clear();
  const Problem parts{s.model, *some.samples, *some.measured, 1, &read, nullptr, &rows, &theta};
  Eigen::VectorXd there = theta;
  there(few) += Eigen::Vector3d(2e-4, -2e-4, 1e-4);
  const NormalEquations a = normal_equations(whole, there, few, scale, weighting, true);
  const NormalEquations b = normal_equations(parts, there, few, scale, weighting, true);
  EXPECT_NEAR(a.cost, b.cost, 1e-9 * a.cost);
  EXPECT_LT((a.A - b.A).norm(), 1e-9 * a.A.norm());
  EXPECT_LT((a.g - b.g).norm(), 1e-9 * a.g.norm());
  const Eigen::Vector3d weak = Eigen::Vector3d(1, -1, 0).normalized();
  EXPECT_LT(weak.dot(without * weak), 0.5 * weak.dot(b.A * weak));
  EXPECT_GT(rows.reads, 1);
  // Once kept, the changes are those of the rows in memory, and no pass finds them again.
  LoadResponse kept = *response;
  keep_changes(parts, kept);
  ASSERT_EQ(kept.of_source.size(), response->change.size());
  for (std::size_t k = 0; k < kept.of_source.size(); ++k)
    EXPECT_LT((kept.of_source[k] - response->change[k]).norm(), 1e-9 * response->change[k].norm());
  kept.change.clear();
  kept.found_at.setZero();  // where nothing could be found
  const Problem with_kept{s.model, *some.samples, *some.measured, 1, &kept, nullptr, &rows, &theta};
  const NormalEquations c = normal_equations(with_kept, there, few, scale, weighting, true);
  EXPECT_LT((c.A - b.A).norm(), 1e-9 * b.A.norm());
  EXPECT_LT((c.g - b.g).norm(), 1e-9 * b.g.norm());
}

TEST(RowSource, FewRowsCanBeReadToo) {
  const Scene s = scene(64, What::kPositions, 60, {5e-5, 0});
  const RowsOfScene rows(s);
  expect_same(read(s, rows, {}), s.identified());
  EXPECT_GT(rows.reads, 0);
}

TEST(RowErrors, AreWhatResidualsSay) {
  Scene s = scene(65, What::kPoses, 300, {5e-5, 1e-4});
  s.measured.position(3, 1) = kNan;
  s.measured.rotation.row(4).setConstant(kNan);
  const Problem problem{s.model, s.samples, s.measured};
  const RowErrors errors(problem, s.truth);
  const RowMatrixXd r = residuals(problem, s.truth);
  const CommonNoise tau{2e-5, 3e-4};
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    double squared = 0;
    int known = 0;
    for (Eigen::Index c = 0; c < 6; ++c) {
      if (std::isnan(r(i, c))) continue;
      squared += std::pow(r(i, c) / tau[static_cast<std::size_t>(c / 3)], 2);
      ++known;
    }
    EXPECT_NEAR(errors.whitened(i, tau).squared, squared, 1e-12 * squared);
    EXPECT_EQ(errors.components(i), known);
  }
  EXPECT_EQ(errors.observed(0).unclaimed(2).size(), 1U);
  EXPECT_EQ(errors.observed(0).unclaimed(3).size(), 299U);
  EXPECT_EQ(errors.observed(1).count(), 299U);
  EXPECT_EQ(errors.number_count(0), 899);
  std::vector<bool> kept(300, false);
  kept[7] = true;
  EXPECT_NEAR(errors.observed(1, kept).unclaimed(3)[0], r.row(7).tail<3>().squaredNorm(), 1e-20);
}

}  // namespace
}  // namespace fastcal::test
