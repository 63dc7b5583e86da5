// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What every registered effect promises, on an arm that has everything: masses, a slider, a spring, motors, all columns
// of data.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "effects/loaded.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/se3.hpp"
#include "fastcal/model/prediction.hpp"
#include "support/robots.hpp"
#include "support/structures.hpp"

namespace fastcal::test {
namespace {

constexpr int kJoints = 6;
constexpr int kSlider = 3;

RobotModel complete_arm(double moved = 0) {
  RobotDescription description;
  description.joint_types.assign(kJoints, JointType::kRevolute);
  description.joint_types[kSlider] = JointType::kPrismatic;
  description.bodies.resize(kJoints);
  for (int i = 0; i < kJoints; ++i) {
    description.bodies[static_cast<std::size_t>(i)].mass = 30 - 4 * i;
    description.bodies[static_cast<std::size_t>(i)].com = {-0.1, 0.02, 0.05};
  }
  description.T_world_base = {rpy_to_rotation({0.3, -0.2, 1.1}), {0.5, -1, 0.2}};
  description.T_flange_tool = {rpy_to_rotation({0.1, 0.4, -0.2}), {0.05, 0.02, 0.15}};
  description.p_flange_payload = {0.02, 0, 0.08};
  description.coupling = Eigen::MatrixXd::Zero(kJoints, kJoints);
  description.coupling(5, 4) = -0.01;
  description.motor_ratio = Eigen::VectorXd::Constant(kJoints, 101);
  description.compensator = Compensator{1, {0, 0.3, 0}, {0.4, 0, 0}, 1e4, 0.2};
  description.bending = six_axis_beams();
  Tables t = six_axes(0.1);
  Random random(7);
  for (double& number : t.rows.reshaped()) number += moved * random.uniform(-1, 1);
  return build_dh(description, t.rows);
}

Samples complete_samples(int rows) {
  Random random(11);
  Samples out;
  out.q = RowMatrixXd::NullaryExpr(rows, kJoints, [&] { return random.uniform(-1.2, 1.2); });
  out.payload = Eigen::VectorXd::NullaryExpr(rows, [&] { return random.uniform(0, 40); });
  out.wrench = RowMatrixXd::NullaryExpr(rows, 6, [&] { return random.uniform(-50, 50); });
  out.temperature = Eigen::VectorXd::NullaryExpr(rows, [&] { return random.uniform(290, 310); });
  out.time = Eigen::VectorXd::NullaryExpr(rows, [&] { return random.uniform(-5000, 5000); });
  out.station = Eigen::VectorXi::NullaryExpr(rows, [&] { return random.whole(0, 1); });
  out.mount = Eigen::VectorXi::NullaryExpr(rows, [&] { return random.whole(0, 1); });
  out.approach = RowMatrixXd::NullaryExpr(rows, kJoints, [&] { return random.whole(-1, 1); });
  out.current = RowMatrixXd::NullaryExpr(rows, kJoints, [&] { return random.uniform(-10, 10); });
  out.extra = RowMatrixXd::NullaryExpr(rows, 1, [&] { return random.uniform(-2, 2); });
  return out;
}

bool holds(const std::vector<std::string>& texts, const std::string& text) {
  return std::find(texts.begin(), texts.end(), text) != texts.end();
}

/// What an effect cannot do without.
Options least_options(const std::string& name) {
  if (name == "regressor") return {{"column", std::string("tilt")}};
  if (name == "range_wave") return {{"period", 0.7}};
  if (name == "base_settling") return {{"begins", -5000.0}, {"tau", 2000.0}};
  if (holds({"base_step", "tool_step", "zero_step", "range_step"}, name)) return {{"at", 0.0}};
  return {};
}

/// The effect alone, at random parameters of plausible size within their bounds.
ErrorModel alone(const std::string& name, const std::string& owner, double size) {
  const RobotModel robot = complete_arm();
  const auto effect = make_effect(name, robot, owner, least_options(name));
  Random random(5);
  Eigen::VectorXd values(static_cast<Eigen::Index>(effect->parameters().size()));
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const Parameter& p = effect->parameters()[static_cast<std::size_t>(k)];
    values[k] = size * std::clamp(random.uniform(0.3, 1) * p.sigma, p.lower, p.upper);
  }
  return ErrorModel(robot, {effect}, values);
}

std::vector<double> poses(const ErrorModel& model, const Samples& samples, int threads = 1) {
  std::vector<double> out(static_cast<std::size_t>(16 * samples.count()));
  predict(model, samples, model.start(), threads, out.data());
  return out;
}

class EffectContract : public testing::TestWithParam<std::string> {
 protected:
  std::vector<std::string> owners() const { return effect_entry(GetParam()).owners(complete_arm()); }
};

TEST_P(EffectContract, HasAnOwnerOnThisArm) { EXPECT_FALSE(owners().empty()); }

TEST_P(EffectContract, ZeroParametersAreTheNominalRobotExactly) {
  const Samples samples = complete_samples(20);
  const std::vector<double> nominal = poses(ErrorModel(complete_arm()), samples);
  for (const std::string& owner : owners()) EXPECT_EQ(poses(alone(GetParam(), owner, 0), samples), nominal) << owner;
}

TEST_P(EffectContract, DerivativesAreThoseOfCentralDifferences) {
  for (const std::string& owner : owners()) {
    const ErrorModel model = alone(GetParam(), owner, 1);
    Samples samples = complete_samples(4);
    settle(model, model.start(), 1, samples);
    const auto own = model.robot().nominal().size();
    RowEvaluator rows(model, model.start());
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.parameter_count());
    for (Eigen::Index i = 0; i < samples.count(); ++i) {
      rows.jacobian(samples.row(i), J);
      for (Eigen::Index k = own; k < model.parameter_count(); ++k) {
        const double h = 0.1 * model.parameters()[static_cast<std::size_t>(k)].sigma;
        Eigen::VectorXd up = model.start();
        Eigen::VectorXd down = up;
        up[k] += h;
        down[k] -= h;
        const Pose a = RowEvaluator(model, up).pose(samples.row(i));
        const Pose b = RowEvaluator(model, down).pose(samples.row(i));
        Vector6d expected;
        expected << (a.p - b.p) / (2 * h), log_so3(a.R * b.R.transpose()) / (2 * h);
        // Rounding of a pose of a few metres over the step, and the differences' own error of third order.
        EXPECT_LT((J.col(k) - expected).norm(), 1e-14 / h + 1e-6 * expected.norm())
            << owner << " " << model.parameters()[static_cast<std::size_t>(k)].name;
      }
    }
  }
}

TEST_P(EffectContract, AddsInBulkWhatItSaysRowByRow) {
  constexpr int kRows = 5, kBegin = 2, kFirst = 7;
  for (const std::string& owner : owners()) {
    const ErrorModel model = alone(GetParam(), owner, 1);
    const auto* effect = dynamic_cast<const LinearEffect*>(model.effects().front().get());
    if (effect == nullptr) continue;
    Samples samples = complete_samples(kBegin + kRows);
    settle(model, model.start(), 1, samples);
    samples.output *= 1.01;  // as if gears had errors
    TwistTable bulk, single;
    bulk.clear(kRows);
    single.clear(kRows);
    bulk.count_from(kFirst);
    single.count_from(kFirst);
    if (!effect->add_basis(samples, kBegin, kRows, bulk)) continue;
    for (int i = 0; i < kRows; ++i) {
      TwistColumns columns;
      effect->basis(samples.row(kBegin + i), columns);
      single.add(columns, i);
    }
    for (const TwistTable::Entry& entry : single.entries()) {
      for (int k = 0; k < 6; ++k) {
        const double* expected = entry.part(k, kRows);
        if (expected == nullptr) continue;
        const double* found = bulk.part(entry.parameter - kFirst, entry.frame, k);
        for (int i = 0; i < kRows; ++i) EXPECT_NEAR(found[i], expected[i], 1e-15 * std::abs(expected[i])) << owner;
      }
    }
    EXPECT_EQ(bulk.bytes(), single.bytes()) << owner;
  }
}

Eigen::ArrayXd read(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::ArrayXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// To the bit where an effect states a reference; others count from what a moved geometry changes by hundredths.
TEST_P(EffectContract, KeepsItsMeaningWhereTheGeometryHasMoved) {
  const RobotModel robot = complete_arm(), moved = complete_arm(2e-3);
  const Samples samples = complete_samples(7);
  for (const std::string& owner : owners()) {
    const auto effect = make_effect(GetParam(), robot, owner, least_options(GetParam()));
    Options options = least_options(GetParam());
    for (const auto& [key, list] : effect->reference()) options[key] = list.values;
    const auto again = make_effect(GetParam(), moved, owner, options);
    Eigen::VectorXd values(static_cast<Eigen::Index>(effect->parameters().size()));
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      const Parameter& p = effect->parameters()[static_cast<std::size_t>(k)];
      values[k] = std::clamp((k % 2 ? 0.5 : 0.9) * p.sigma, p.lower, p.upper);
    }
    const auto of = [&](const std::shared_ptr<const Effect>& one) {
      return read(poses(ErrorModel(moved, {one}, values), samples));
    };
    const Eigen::ArrayXd first = of(effect), none = read(poses(ErrorModel(moved), samples));
    const double allowed = effect->reference().empty() ? 0.05 * (first - none).matrix().norm() : 0.0;
    EXPECT_LE((of(again) - first).matrix().norm(), allowed) << owner;
  }
}

TEST_P(EffectContract, TwoThreadsGiveTheSameBits) {
  const Samples samples = complete_samples(repeat(1000) + 300);
  const ErrorModel model = alone(GetParam(), owners().front(), 1);
  EXPECT_EQ(poses(model, samples, 1), poses(model, samples, 2));
}

TEST_P(EffectContract, ParametersAreDescribed) {
  for (const std::string& owner : owners()) {
    const auto effect = make_effect(GetParam(), complete_arm(), owner, least_options(GetParam()));
    std::set<std::string> names;
    EXPECT_FALSE(effect->parameters().empty());
    for (const Parameter& p : effect->parameters()) {
      EXPECT_TRUE(names.insert(p.name).second) << p.name;
      EXPECT_FALSE(p.owner.empty());
      EXPECT_FALSE(p.unit.empty());
      EXPECT_FALSE(p.doc.empty());
      EXPECT_GT(p.sigma, 0);
      EXPECT_LE(p.lower, 0);
      EXPECT_GE(p.upper, 0);
    }
    EXPECT_TRUE(effect->penalty().empty() || effect->penalty().size() == effect->parameters().size());
  }
}

/// "joint" of "joint6<-joint5".
std::string kind_of(const std::string& owner) { return owner.substr(0, owner.find_first_of("0123456789")); }

TEST_P(EffectContract, TellsWhatAnyoneMayAsk) {
  const Traits& traits = effect_entry(GetParam()).traits;
  const auto effect = make_effect(GetParam(), complete_arm(), owners().front(), least_options(GetParam()));
  EXPECT_FALSE(traits.phrase.empty());
  EXPECT_FALSE(traits.shown_by.empty());
  EXPECT_FALSE(traits.depends_on.empty());
  EXPECT_TRUE(traits.plotted_over == "itself" || holds(traits.depends_on, traits.plotted_over));
  EXPECT_TRUE(effect->data_columns().empty() || !traits.needs_data.empty());
  // Effects whose own motion is a load times a number say so twice: to the model by needs(), to people by depends_on.
  EXPECT_EQ(effect->follows_loads(), holds(traits.depends_on, "torque") || holds(traits.depends_on, "load"));
  const std::vector<std::string> places{"joint",      "link",      "base", "tool", "payload",
                                        "instrument", "structure", "",     "",     ""};
  const std::string& place = places[static_cast<std::size_t>(traits.place)];
  for (const std::string& owner : owners())
    EXPECT_TRUE(place.empty() || kind_of(owner) == place || owner == "robot") << owner;
}

TEST_P(EffectContract, TraitsNameWhatThereIs) {
  const Traits& traits = effect_entry(GetParam()).traits;
  const auto effect = make_effect(GetParam(), complete_arm(), owners().front(), least_options(GetParam()));
  std::vector<std::string> names;
  for (const Parameter& p : effect->parameters()) names.push_back(p.name);
  for (const std::string& simpler : traits.generalizes) EXPECT_TRUE(holds(effect_names(), simpler)) << simpler;
  EXPECT_TRUE(traits.contrast.empty() || (traits.contrast.size() == 2 && !traits.generalizes.empty()));
  for (const std::string& parameter : traits.contrast) EXPECT_TRUE(holds(names, parameter)) << parameter;
  EXPECT_TRUE(traits.searched.empty() || holds(names, traits.searched) ||
              holds(traits.among_parameters, traits.searched));
  EXPECT_EQ(holds(names, ""), !traits.number.empty());
  EXPECT_TRUE(!traits.is_wave || names.size() == 2);
}

TEST_P(EffectContract, UnknownOwnersAndOptionsAreRefused) {
  Options options = least_options(GetParam());
  EXPECT_THROW(make_effect(GetParam(), complete_arm(), "elbow", options), InvalidInput);
  options["colour"] = 1.0;
  EXPECT_THROW(make_effect(GetParam(), complete_arm(), owners().front(), options), InvalidInput);
}

/// All but those of closed loops, which tests/python/effects/test_pin_slack.py and test_rods.py ask the same.
std::vector<std::string> names_on_this_arm() {
  std::vector<std::string> out = effect_names();
  std::erase_if(out, [](const std::string& name) { return name.starts_with("pin_") || name.starts_with("rod_"); });
  return out;
}

INSTANTIATE_TEST_SUITE_P(All, EffectContract, testing::ValuesIn(names_on_this_arm()),
                         [](const auto& info) { return info.param; });

/// Effects register themselves: were their files dropped by a linker, nobody would say so.
TEST(EffectRegistry, HoldsTheseNames) {
  const std::vector<std::string> expected{"backlash",           "base_drift",        "base_settling",
                                          "base_step",          "beam_gravity",      "bearing_tilt",
                                          "compensator_spring", "coupling_ratio",    "current_compliance",
                                          "encoder_jump",       "friction",          "gear_harmonic",
                                          "gravity_sag",        "joint_compliance",  "joint_compliance_nonlinear",
                                          "joint_profile",      "link_bending",      "link_com",
                                          "link_mass",          "link_torsion",      "measurement_scale",
                                          "payload_com",        "payload_mass",      "pin_compliance",
                                          "pin_slack",          "posture_backlash",  "range_step",
                                          "range_wave",         "reduction_ratio",   "regressor",
                                          "rod_compliance",     "rod_slack",         "settling",
                                          "station_offset",     "surrogate",         "thermal_base",
                                          "thermal_bending",    "thermal_expansion", "thermal_offset",
                                          "thermal_spring",     "tool_shift",        "tool_step",
                                          "tracker_angle",      "tracker_range",     "zero_step"};
  EXPECT_EQ(effect_names(), expected);
}

/// The diagnosis asks for the curve of a joint and for that of a frame.
TEST(EffectRegistry, HoldsOneCurveOfAPlace) {
  std::vector<Place> places;
  for (const std::string& name : effect_names()) {
    const Traits& traits = effect_entry(name).traits;
    if (traits.role == Role::kCurve) places.push_back(traits.place);
  }
  EXPECT_EQ(places, (std::vector<Place>{Place::kJoint, Place::kFrame, Place::kAnywhere}));
}

TEST(EffectRegistry, AnUnknownNameIsRefusedWithTheKnownOnes) {
  try {
    make_effect("rust", complete_arm(), "joint1", {});
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("backlash"), std::string::npos);
  }
}

}  // namespace
}  // namespace fastcal::test
