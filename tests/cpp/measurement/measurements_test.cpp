// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What every observation must obey, for all registered kinds; then the numbers of each kind by hand.
#include "fastcal/measurement/measurements.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "support/robots.hpp"

namespace fastcal {
namespace {

using test::Random;

const double kNan = std::nan("");

Eigen::Vector4d wxyz(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return {q.w(), q.x(), q.y(), q.z()};
}

RobotModel arm() { return test::build("dh", test::six_axes()); }

/// Two rows in which everything registered was measured: the second in parts.
Tables tables(Random& random) {
  Tables out{2, {}, {}};
  out.numbers["position"] = RowMatrixXd::NullaryExpr(2, 3, [&] { return random.uniform(-1, 1); });
  out.numbers["rotation"].resize(2, 4);
  for (int i = 0; i < 2; ++i) out.numbers["rotation"].row(i) = wxyz(random.rotation()).transpose();
  out.numbers["distance"] = RowMatrixXd::Constant(2, 1, 1.5);
  out.numbers["tilt@link3"] = RowMatrixXd::NullaryExpr(2, 2, [&] { return random.uniform(-0.5, 0.5); });
  out.numbers["tilt@link5"] = out.numbers["tilt@link3"];
  out.labels["anchor"] = {Eigen::Vector2i(1, 0), {"a", "b"}};
  out.labels["plane"] = {Eigen::Vector2i(0, -1), {"top"}};
  out.labels["socket"] = {Eigen::Vector2i(0, -1), {"left", "right"}};
  out.labels["ball"] = {Eigen::Vector2i(1, -1), {"left", "right"}};
  out.labels["cube"] = {Eigen::Vector2i(1, -1), {"block/z", "block/x", "block/y"}};
  out.numbers["dial"] = RowMatrixXd::Constant(2, 1, 0.01);
  out.labels["gauge"] = {Eigen::Vector2i(1, 0), {"a", "b"}};
  return out;
}

/// One observation out of those of two rows, by its number; a name for the test.
class Contract : public testing::TestWithParam<std::size_t> {
 protected:
  Random random_{7};
  Tables tables_ = tables(random_);
  Measurements all_{tables_, arm()};
  const PlacedObservation& of_ = all_.observations()[GetParam()];
  Eigen::VectorXd unknowns_ = random_.values(of_.unknown_count, 0.4);
  Sights sights_{random_.pose(1), random_.pose(1)};

  Comparison compared(const Sights& sights, const Eigen::VectorXd& unknowns, Eigen::Index row = 0) const {
    Comparison out;
    out.clear();
    of_->compare(row, sights, unknowns.data(), out);
    return out;
  }
};

TEST_P(Contract, NamesAreThereAndUnitsAreKnown) {
  EXPECT_FALSE(of_->name().empty());
  EXPECT_TRUE(of_->unit() == "m" || of_->unit() == "rad");
  for (const Parameter& parameter : of_->parameters()) {
    EXPECT_GT(parameter.sigma, 0);
    EXPECT_FALSE(parameter.doc.empty() || parameter.owner.empty() || parameter.name.empty());
    EXPECT_TRUE(parameter.unit == "m" || parameter.unit == "rad");
  }
}

TEST_P(Contract, DerivativesAreThoseOfTheResidual) {
  constexpr double h = 1e-3;
  const Comparison here = compared(sights_, unknowns_);
  const auto slope = [&](const std::function<Eigen::Vector3d(double)>& r) -> Eigen::Vector3d {
    return (8 * (r(h) - r(-h)) - (r(2 * h) - r(-2 * h))) / (12 * h);
  };
  for (std::size_t f = 0; f < of_.frames.size(); ++f) {
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d wanted = slope([&](double step) {
        Sights there = sights_;
        if (k < 3) there[f].p[k] += step;
        if (k >= 3) there[f].R = exp_so3(step * Eigen::Vector3d::Unit(k - 3)) * there[f].R;
        return compared(there, unknowns_).r;
      });
      EXPECT_LT((here.by_frame[f].col(k) - wanted).norm(), 1e-8) << of_->name() << " by frame " << f << ", " << k;
    }
  }
  for (int k = 0; k < of_.unknown_count; ++k) {
    const Eigen::Vector3d wanted = slope([&](double step) {
      Eigen::VectorXd there = unknowns_;
      there[k] += step;
      return compared(sights_, there).r;
    });
    const int own = k - here.first_unknown;
    const bool depends = own >= 0 && own < here.unknown_count;
    const Eigen::Vector3d found = depends ? here.by_unknown.col(own).eval() : Eigen::Vector3d::Zero();
    EXPECT_LT((found - wanted).norm(), 1e-8) << of_->name() << " by unknown " << k;
  }
}

TEST_P(Contract, WhatWasNotMeasuredIsAbsent) {
  for (auto& [name, table] : tables_.numbers) table.row(1).setConstant(kNan);
  for (auto& [name, labels] : tables_.labels) labels.codes[1] = -1;
  const Measurements empty(tables_, arm());
  Comparison out;
  out.clear();
  empty.observations()[GetParam()]->compare(1, sights_, unknowns_.data(), out);
  for (const bool present : out.present) EXPECT_FALSE(present);
  EXPECT_EQ(out.r.norm(), 0);
}

/// Unknowns from readings without noise: the residuals there are zero.
TEST_P(Contract, ItsStartIsExactOnExactReadings) {
  if (of_.unknown_count == 0) return;
  const RobotModel robot = arm();
  constexpr Eigen::Index kRows = 60;
  std::vector<Sights> sights;
  for (Eigen::Index i = 0; i < kRows; ++i) sights.push_back({random_.pose(1), sights_[1]});
  Tables readings{kRows, {}, {}};
  // A plane or a socket is touched where the arm is put on it; others are read off.
  const bool touches = of_->field().empty();
  if (of_->name() == "socket") {
    for (std::size_t i = 0; i < sights.size(); ++i) sights[i][0].p = Eigen::Vector3d(0.1, -0.2, 0.3 + double(i % 2));
  } else if (of_->name() == "ball") {
    for (std::size_t i = 0; i < sights.size(); ++i)
      sights[i][0].p = Eigen::Vector3d(2, -1, 0.5 + double(i % 2)) + 0.05 * random_.unit();
  } else if (of_->name() == "cube") {
    const Eigen::Matrix3d axes = random_.rotation();
    for (std::size_t i = 0; i < sights.size(); ++i) {  // labels in turn: block/z, block/x, block/y
      const Eigen::Vector3d normal = axes.col(static_cast<Eigen::Index>((i + 2) % 3));
      sights[i][0].p += (0.4 + 0.1 * double(i % 3) - normal.dot(sights[i][0].p)) * normal;
    }
  } else if (touches) {
    const Eigen::Vector3d normal = random_.unit();
    for (Sights& at : sights) at[0].p += (0.4 - normal.dot(at[0].p)) * normal;
  } else {
    readings.numbers[of_->field()] = RowMatrixXd::Zero(kRows, of_.component_count);
  }
  for (const auto& [name, labels] : tables_.labels) {
    const int count = static_cast<int>(labels.names.size());
    readings.labels[name] = {Eigen::VectorXi::NullaryExpr(kRows, [&](Eigen::Index i) { return int(i) % count; }),
                             labels.names};
  }
  const auto build = [&] {
    const Measurements measured(readings, robot);
    for (const PlacedObservation& candidate : measured.observations()) {
      if (candidate->name() == of_->name()) return candidate;
    }
    throw std::logic_error("not built");
  };
  const auto residual = [&](const PlacedObservation& from, const Eigen::VectorXd& unknowns, Eigen::Index i) {
    Comparison out;
    out.clear();
    from->compare(i, sights[i], unknowns.data(), out);
    return out.r;
  };
  PlacedObservation observed = build();
  if (!touches) {
    for (int round = 0; round < 30; ++round) {  // to where the residual of what is read is zero
      for (Eigen::Index i = 0; i < kRows; ++i)
        readings.numbers[of_->field()].row(i) += residual(observed, unknowns_, i).head(of_.component_count).transpose();
      observed = build();
    }
  }
  Eigen::VectorXd start(of_.unknown_count);
  ASSERT_EQ(observed->start(sights, start), "");
  for (Eigen::Index i = 0; i < kRows; ++i) EXPECT_LT(residual(observed, start, i).norm(), 1e-9) << of_->name();
}

INSTANTIATE_TEST_SUITE_P(All, Contract, testing::Range<std::size_t>(0, 10));

TEST(Registry, HasTheseKinds) {
  EXPECT_EQ(observation_names(), (std::vector<std::string>{"ball", "corner", "cube", "dial", "length", "orientation",
                                                           "plane", "position", "socket", "tilt"}));
  EXPECT_THROW(observation_entry("smell"), InvalidInput);
  for (const std::string& name : observation_names()) {  // commands count on it
    const auto& fields = observation_entry(name).fields;
    EXPECT_TRUE(std::any_of(fields.begin(), fields.end(), [](const Field& f) { return f.role == FieldRole::kSigma; }));
  }
  Random random(1);
  EXPECT_EQ(Measurements(tables(random), arm()).observation_count(), 10);  // as many as Contract runs over
}

TEST(Measurements, ThePositionComesFirstAndTheOthersFollow) {
  Random random(1);
  const Measurements measured(tables(random), arm());
  EXPECT_EQ(measured.observations()[0]->name(), "position");
  EXPECT_EQ(measured.number_count(), 3 + 3 + 1 + 1 + 3 + 2 + 2 + 1 + 1 + 1);
  EXPECT_EQ(measured.unknown_count(), 6 + 3 + 6 + 3 + 3 + 8 + 6 + 6);
  int number = 0;
  int unknown = 0;
  for (const PlacedObservation& of : measured.observations()) {
    EXPECT_EQ(of.first_number, number);
    EXPECT_EQ(of.first_unknown, unknown);
    number += of.component_count;
    unknown += of.unknown_count;
  }
  EXPECT_TRUE(measured.shows_base() && measured.shows_tool_turn());
}

TEST(Measurements, SigmaOfALengthIsThatOfTheFirstCoordinateAndOfASocketTheirMean) {
  Random random(1);
  Tables all = tables(random);
  EXPECT_FALSE(Measurements(all, arm()).claims_sigma());
  all.numbers["sigma_position"] = Eigen::RowVector3d(1, 2, 3).replicate(2, 1);
  all.numbers["sigma_rotation"] = RowMatrixXd::Constant(2, 1, 4);
  all.numbers["sigma_tilt"] = RowMatrixXd::Constant(2, 1, 5);
  const Measurements measured(all, arm());
  EXPECT_TRUE(measured.claims_sigma());
  std::map<std::string, double> last;
  for (int c = 0; c < measured.number_count(); ++c)
    last[measured.observations()[measured.observation_of(c)]->name()] = measured.sigma(0, c);
  EXPECT_EQ(last, (std::map<std::string, double>{{"position", 3},
                                                 {"orientation", 4},
                                                 {"ball", 1},
                                                 {"cube", 1},
                                                 {"dial", 0},
                                                 {"length", 1},
                                                 {"plane", 1},
                                                 {"socket", std::sqrt(14.0) / std::sqrt(3.0)},
                                                 {"tilt of link3", 5},
                                                 {"tilt of link5", 5}}));
}

TEST(Position, SeenFromAnInstrumentIsAlongItsBeamAndAcross) {
  Tables of{3, {}, {}};
  of.numbers["position"].resize(3, 3);
  of.numbers["position"] << 2, 0, 0, 0, 0, 3, 1, 2, 3;
  of.numbers["sigma_position"] = RowMatrixXd::Constant(3, 3, 1e-4);
  of.numbers["instrument"].resize(3, 3);
  of.numbers["instrument"] << 0, 0, 0, 0, 0, 1, kNan, kNan, kNan;
  const Measurements measured(of, arm());
  const PlacedObservation& points = measured.observations().front();
  EXPECT_EQ(points->coordinates(), nullptr);
  const auto residual = [&](Eigen::Index row, const Eigen::Vector3d& off) {
    Sights sights;
    sights[0].p = of.numbers["position"].row(row).transpose() + off;
    Comparison out;
    out.clear();
    points->compare(row, sights, nullptr, out);
    EXPECT_LT((out.by_frame[0].leftCols<3>() * off - out.r).norm(), 1e-15);
    return out.r;
  };
  // The beam is x: across it y is level and z upright.
  EXPECT_TRUE(residual(0, {0.1, 0.2, 0.3}).isApprox(Eigen::Vector3d(0.1, 0.2, 0.3), 1e-12));
  // An upright beam is z; y counts as level, and -x is then upright.
  EXPECT_TRUE(residual(1, {0.1, 0.2, 0.3}).isApprox(Eigen::Vector3d(0.3, 0.2, -0.1), 1e-12));
  // Where no instrument is known, x, y and z.
  EXPECT_TRUE(residual(2, {0.1, 0.2, 0.3}).isApprox(Eigen::Vector3d(0.1, 0.2, 0.3), 1e-12));
  of.numbers["instrument"].row(0) = of.numbers["position"].row(0);
  EXPECT_THROW(Measurements(of, arm()), InvalidInput);
}

/// Readings of a tag that one arm carries, from a camera on another.
TEST(Measurements, AReadingFromOneFrameOfAnotherDependsOnBoth) {
  Random random(5);
  const auto robot = std::make_shared<const RobotModel>(arm());
  const RobotModel two = join({{"left", robot, {}, "world"},
                               {"right", robot, {}, "world"},
                               {"tag", nullptr, random.pose(1), "left.link6"},
                               {"camera", nullptr, random.pose(1), "right.link2"}});
  Tables of{1, {}, {}};
  of.numbers["position@tag:camera"] = random.vector(1).transpose();
  of.numbers["rotation@tag:camera"] = wxyz(random.rotation()).transpose();
  of.numbers["sigma_position@tag:camera"] = RowMatrixXd::Constant(1, 3, 0.1);
  of.numbers["position@tag"] = random.vector(1).transpose();
  const Measurements measured(of, two);
  EXPECT_EQ(measured.number_count(), 9);
  constexpr double h = 1e-3;
  const Sights here{random.pose(1), random.pose(1)};
  for (const PlacedObservation& placed : measured.observations()) {
    const auto r = [&](const Sights& sights) {
      Comparison out;
      out.clear();
      placed->compare(0, sights, nullptr, out);
      return out;
    };
    const bool is_of_two = placed->name() != "position@tag";
    EXPECT_EQ(placed.frames, is_of_two ? (std::vector<int>{two.tree().frame("tag"), two.tree().frame("camera")})
                                       : (std::vector<int>{two.tree().frame("tag")}));
    EXPECT_EQ(placed->coordinates(), nullptr);
    for (std::size_t f = 0; f < placed.frames.size(); ++f) {
      for (int k = 0; k < 6; ++k) {
        const auto moved = [&](double step) -> Eigen::Vector3d {
          Sights there = here;
          if (k < 3) there[f].p[k] += step;
          if (k >= 3) there[f].R = exp_so3(step * Eigen::Vector3d::Unit(k - 3)) * there[f].R;
          return r(there).r;
        };
        const Eigen::Vector3d wanted = (8 * (moved(h) - moved(-h)) - (moved(2 * h) - moved(-2 * h))) / (12 * h);
        EXPECT_LT((r(here).by_frame[f].col(k) - wanted).norm(), 1e-8) << placed->name() << " frame " << f << ", " << k;
      }
    }
  }
  of.numbers["position@hand"] = of.numbers["position@tag"];
  EXPECT_THROW(Measurements(of, two), InvalidInput);
}

TEST(Orientation, IsTheTurnInTheAxesOfTheTool) {
  Random random(3);
  const Eigen::Vector3d turn(0.1, -0.2, 0.3);
  const Eigen::Matrix3d R = random.rotation();
  Tables one{1, {{"rotation", wxyz(R * exp_so3(-turn)).transpose()}}, {}};
  Comparison out;
  out.clear();
  Measurements(one, arm()).observations()[0]->compare(0, {Pose{R, {}}, {}}, nullptr, out);
  EXPECT_LT((out.r - turn).norm(), 1e-13);
}

TEST(Length, IsPredictedLessMeasuredAlsoInItsAnchor) {
  const Tables one{
      1, {{"distance", RowMatrixXd::Constant(1, 1, 0.3)}}, {{"anchor", {Eigen::VectorXi::Zero(1), {"a"}}}}};
  const Measurements measured(one, arm());
  const Eigen::Vector3d anchor(1, 2, 3);
  Comparison out;
  out.clear();
  measured.observations()[0]->compare(0, {Pose{{}, anchor + Eigen::Vector3d(0, 0.5, 0)}, {}}, anchor.data(), out);
  EXPECT_NEAR(out.r[0], 0.2, 1e-15);
  out.clear();
  measured.observations()[0]->compare(0, {Pose{{}, anchor}, {}}, anchor.data(), out);
  EXPECT_NEAR(out.r[0], -0.3, 1e-15);
  EXPECT_NEAR(out.by_frame[0].row(0).norm(), 1, 1e-15);
}

TEST(Plane, HeightIsThatOverThePlane) {
  const Tables one{1, {}, {{"plane", {Eigen::VectorXi::Zero(1), {"wall"}}}}};
  const Measurements measured(one, arm());
  const Eigen::Vector3d wall(0, M_PI / 2, 0.7);  // z turned about y is x: the plane x = 0.7
  Comparison out;
  out.clear();
  measured.observations()[0]->compare(0, {Pose{{}, {1, 5, -3}}, {}}, wall.data(), out);
  EXPECT_NEAR(out.r[0], 0.3, 1e-15);
  EXPECT_EQ(measured.parameters()[2].owner, "plane wall");
}

TEST(Ball, DistanceIsThatOverTheSphere) {
  const Tables one{1, {}, {{"ball", {Eigen::VectorXi::Zero(1), {"gauge"}}}}};
  const Measurements measured(one, arm());
  const Eigen::Vector4d ball(1, 2, 3, 0.4);
  Comparison out;
  out.clear();
  measured.observations()[0]->compare(0, {Pose{{}, {1, 2, 3.5}}, {}}, ball.data(), out);
  EXPECT_NEAR(out.r[0], 0.1, 1e-15);
  EXPECT_EQ(measured.parameters()[3].owner, "ball gauge");
  EXPECT_EQ(measured.parameters()[3].name, "radius");
}

TEST(Ball, TouchesOnOneCircleFixNone) {
  const auto missing = [](int count) {
    const Tables touched{count, {}, {{"ball", {Eigen::VectorXi::Zero(count), {"b"}}}}};
    std::vector<Sights> sights;
    for (int i = 0; i < count; ++i) sights.push_back({Pose{{}, {std::cos(0.7 * i), std::sin(0.7 * i), 2}}, {}});
    Eigen::VectorXd start(4);
    return Measurements(touched, arm()).observations()[0]->start(sights, start);
  };
  EXPECT_EQ(missing(8), "touches of ball b lie on one circle; touch it from above and from all sides");
  EXPECT_EQ(missing(4), "each ball needs at least five touches");
}

TEST(Cube, HeightIsThatOverTheFaceOfItsLabel) {
  const Tables two{2, {}, {{"cube", {Eigen::Vector2i(0, 1), {"block/x", "block/z"}}}}};
  const Measurements measured(two, arm());
  Eigen::VectorXd block(6);
  block << 0, 0, M_PI / 2, 0.7, 0.8, 0.9;  // turned about z: its x is y of the frame
  Comparison out;
  out.clear();
  measured.observations()[0]->compare(0, {Pose{{}, {5, 1, -3}}, {}}, block.data(), out);
  EXPECT_NEAR(out.r[0], 0.3, 1e-15);
  out.clear();
  measured.observations()[0]->compare(1, {Pose{{}, {5, 1, 1}}, {}}, block.data(), out);
  EXPECT_NEAR(out.r[0], 0.1, 1e-15);
  ASSERT_EQ(measured.parameters().size(), 6U);  // two labels of one block
  EXPECT_EQ(measured.parameters()[0].owner, "cube block");
}

TEST(Dial, ReadsWhatTheToolMovesAlongIt) {
  Tables one{1, {}, {{"gauge", {Eigen::VectorXi::Zero(1), {"a"}}}}};
  one.numbers["dial"] = RowMatrixXd::Constant(1, 1, 0.002);
  const Measurements measured(one, arm());
  const Eigen::Vector3d along_x(0, M_PI / 2, 0.7);  // z turned about y is x; it reads zero at x = 0.7
  Comparison out;
  out.clear();
  measured.observations()[0]->compare(0, {Pose{{}, {0.703, 5, -3}}, {}}, along_x.data(), out);
  EXPECT_NEAR(out.r[0], 0.001, 1e-15);
}

TEST(Inclination, ALinkThatNodsByTenDegreesLiftsItsXAxisByAsMuch) {
  const double angle = 10 * M_PI / 180;
  const Tables one{1, {{"tilt@link2", Eigen::RowVector2d(angle - 1e-6, 0)}}, {}};
  const Measurements measured(one, arm());
  const Eigen::Vector3d mount = Eigen::Vector3d::Zero();
  Comparison out;
  out.clear();
  const Eigen::Matrix3d nod = exp_so3(Eigen::Vector3d(0, -angle, 0));  // x towards z
  measured.observations()[0]->compare(0, {Pose{exp_so3(Eigen::Vector3d(0, 0, 1)) * nod, {}}, {}}, mount.data(), out);
  EXPECT_NEAR(out.r[0], 1e-6, 1e-12);
  EXPECT_NEAR(out.r[1], 0, 1e-15);
}

TEST(Measurements, BadTablesAreRefusedInASentence) {
  const auto refusal = [](const std::function<void(Tables&)>& spoil) -> std::string {
    Random random(5);
    Tables all = tables(random);
    all.numbers["sigma_position"] = RowMatrixXd::Constant(2, 3, 1e-4);
    spoil(all);
    try {
      Measurements(all, arm());
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal([](Tables&) {}), "nothing was refused");
  EXPECT_EQ(refusal([](Tables& t) { t.numbers["position"].setConstant(kNan); }), "nothing was refused");
  EXPECT_EQ(refusal([](Tables& t) { t.rows = 3; }), "ball must have 3 labels, got 2");
  EXPECT_EQ(refusal([&](Tables& t) { t.numbers["position"](0, 2) = inf; }),
            "position must be finite, or NaN where it was not measured");
  EXPECT_EQ(refusal([](Tables& t) { t.numbers["rotation"].row(0) *= 2; }),
            "row 0: a quaternion must have length 1, got 2");
  EXPECT_EQ(refusal([](Tables& t) { t.numbers["distance"](0, 0) = -1; }), "row 0: a length must not be negative");
  EXPECT_EQ(refusal([](Tables& t) { t.labels["anchor"].codes[0] = 2; }), "row 0: anchor must be -1 to 1, got 2");
  EXPECT_EQ(refusal([](Tables& t) { t.labels["anchor"].codes[1] = -1; }), "row 1: a length needs an anchor");
  EXPECT_EQ(refusal([](Tables& t) { t.labels.erase("anchor"); }), "lengths need an anchor in every row");
  EXPECT_EQ(refusal([](Tables& t) { t.numbers["sigma_position"](0, 1) = 0; }),
            "sigma_position must be positive and finite");
  EXPECT_EQ(refusal([](Tables& t) { t.numbers["sigma_position"](0, 1) = kNan; }),
            "sigma_position must be positive and finite");
  EXPECT_EQ(refusal([](Tables& t) {
              t.numbers.clear();
              t.labels.clear();
            }),
            "nothing was measured; expected touches of a ball, corners, touches of a cube, readings of a dial gauge, "
            "lengths, orientations, touches of a plane, positions, touches of a socket, inclinations");
  EXPECT_EQ(refusal([](Tables& t) { t.labels["cube"].names[0] = "block"; }),
            "column 'cube': expected labels such as block/x, block/y and block/z, got 'block'");
  EXPECT_EQ(refusal([](Tables& t) { t.labels["gauge"].codes[1] = -1; }),
            "row 1: a reading of a dial needs a label in column 'gauge'");
  EXPECT_EQ(refusal([](Tables& t) { t.labels.erase("gauge"); }),
            "readings of a dial gauge need a label in column 'gauge' in every row");
}

}  // namespace
}  // namespace fastcal
