// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// One pass over a serial arm's rows, again and again, for a counter of instructions (bench/serial_arms):
// `serial_arms PASS MODEL LOAD REPETITIONS` prints the sum of the squares of the pass's answer; PASS `every` runs them
// all.
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fastcal/effects/registry.hpp"
#include "fastcal/identification/identify.hpp"
#include "fastcal/ik/pose_solver.hpp"
#include "fastcal/model/prediction.hpp"
#include "fastcal/model/settle.hpp"
#include "support/simulation.hpp"

namespace fastcal::bench {
namespace {

constexpr Eigen::Index kRows = 256;

/// Owners 1 to `count` have an effect each.
struct Own {
  std::string effect, owner;
  int count;
};

const std::vector<Own> kBearing = {{"reduction_ratio", "joint", 6},
                                   {"joint_compliance", "joint", 6},
                                   {"gravity_sag", "joint", 6},
                                   {"link_bending", "link", 3}};
const std::map<std::string, std::vector<Own>> kModels = {{"plain", {}},
                                                         {"ratio", {{"reduction_ratio", "joint", 6}}},
                                                         {"compliance", {{"joint_compliance", "joint", 6}}},
                                                         {"sag", kBearing},
                                                         {"sag_spring", kBearing}};

/// An arm of 2 m reach; where its joints yield, of links of 20 kg, with `spring` a compensator at its second joint.
RobotModel arm(bool heavy, bool spring) {
  const test::Tables tables = test::six_axes();
  RobotDescription description = test::build("dh", tables).description();
  for (Body& body : description.bodies) {
    if (!heavy) break;
    body.mass = 20;
    body.com = {-0.1, 0.02, 0.05};
  }
  if (spring) {
    Compensator compensator;
    compensator.joint = 1;
    compensator.anchor = {0.1, -0.3, 0};
    compensator.arm = {0.3, 0.1, 0};
    compensator.stiffness = 4000;
    compensator.free_length = 0.1;
    description.compensator = compensator;
  }
  return build_dh(description, tables.rows);
}

ErrorModel model_of(const std::string& name) {
  const std::vector<Own>& owns = kModels.at(name);
  const bool heavy = name != "plain" && name != "ratio";
  const RobotModel robot = arm(heavy, name == "sag_spring");
  std::vector<std::shared_ptr<const Effect>> effects;
  Eigen::Index count = 0;
  for (const Own& own : owns) {
    for (int k = 1; k <= own.count; ++k) {
      effects.push_back(make_effect(own.effect, robot, own.owner + std::to_string(k), {}));
      count += static_cast<Eigen::Index>(effects.back()->parameters().size());
    }
  }
  return ErrorModel(robot, effects, Eigen::VectorXd::Constant(count, heavy ? 1e-7 : 1e-4));
}

/// What a pass looks at, and what it says.
struct Task {
  ErrorModel model;
  Eigen::VectorXd start = model.start();
  Samples samples;
  std::vector<int> asked = test::asked(ErrorModel(model.robot(), {}, Eigen::VectorXd()), test::What::kPositions);
  Eigen::VectorXd scale;
  RowMatrixXd poses = RowMatrixXd(kRows, 16);  ///< of `samples`
  test::Measured measured;
  Samples settled, seeds;
  IkOptions options;
  std::vector<double> answer;

  Task(const std::string& name, const std::string& load) : model(model_of(name)) {
    test::Random random(1);
    samples = test::postures(random, kRows, 6);
    if (load == "payload") samples.payload = Eigen::VectorXd::Constant(kRows, 12.0);
    if (load == "wrench") samples.wrench = RowMatrixXd::Constant(kRows, 6, 3.0);
    for (int k = static_cast<int>(asked.size()) + 3; k < model.parameter_count(); ++k) asked.push_back(k);
    scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(asked.size()), 1e-3);
    predict(model, samples, start, 1, poses.data());
    settled = samples;
    settle(model, start, 1, settled);
    measured = test::measure(random, model, settled, start, test::What::kPositions, {5e-5, 0});
    seeds = samples;
    seeds.q = samples.q.table().unaryExpr([&](double q) { return q + random.uniform(-0.1, 0.1); });
    options.limits = RowMatrixXd(6, 2);
    options.limits.col(0).setConstant(-3.5);
    options.limits.col(1).setConstant(3.5);
    options.reach = 2;
  }

  Problem problem() const { return {model, settled, measured, 1}; }
  void jacobian(int rows) {
    answer.resize(static_cast<std::size_t>(rows * kRows * model.parameter_count()));
    parameter_jacobian(model, samples, start, rows, 1, answer.data());
  }
  template <class Table>
  void say(const Table& table) {
    answer.assign(table.data(), table.data() + table.size());
  }
};

void predict_poses(Task& of) {
  of.answer.resize(16 * kRows);
  predict(of.model, of.samples, of.start, 1, of.answer.data());
}

void row_by_row(Task& of) {
  RowEvaluator rows(of.model, of.start);
  of.answer.resize(3 * kRows);
  for (Eigen::Index i = 0; i < kRows; ++i)
    Eigen::Map<Eigen::Vector3d>(of.answer.data() + 3 * i) = rows.pose(of.settled.row(i)).p;
}

void row_jacobians(Task& of) {
  RowEvaluator rows(of.model, of.start);
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, of.model.parameter_count());
  for (Eigen::Index i = 0; i < kRows; ++i) rows.jacobian(of.settled.row(i), J);
  of.say(J);
}

void equilibrium(Task& of) {
  Samples samples = of.samples;
  of.answer = {settle(of.model, of.start, 1, samples)};
  of.answer.insert(of.answer.end(), samples.load.data(), samples.load.data() + samples.load.size());
}

void one_pose_at_a_time(Task& of) {
  PoseSolver solver(of.model, of.seeds.slice(0, 1), of.options);
  SearchPoint found;
  of.answer.clear();
  for (Eigen::Index i = 0; i < kRows; ++i) {
    solver.solve(of.poses.row(i).data(), of.seeds.q.row(i), found);
    of.answer.push_back(solver.forward(of.seeds.q.row(i)).p.x());
  }
}

const std::map<std::string, std::function<void(Task&)>> kPasses = {
    {"predict", predict_poses},
    {"jacobian", [](Task& of) { of.jacobian(3); }},
    {"jacobian_of_poses", [](Task& of) { of.jacobian(6); }},
    {"row_by_row", row_by_row},
    {"row_jacobians", row_jacobians},
    {"equilibrium", equilibrium},
    {"normal",
     [](Task& of) { of.say(normal_equations(of.problem(), of.start, of.asked, of.scale, {{5e-5}}, true).A); }},
    {"triangle", [](Task& of) { of.say(triangular_factor(of.problem(), of.start, of.asked, of.scale, {{5e-5}})); }},
    {"identify",
     [](Task& of) {
       of.say(identify({of.model, of.samples, of.measured, 1}, of.asked, Eigen::VectorXd(), {}).residuals);
     }},
    {"inverse_kinematics",
     [](Task& of) { of.say(inverse_kinematics(of.model, of.start, of.seeds, of.poses, of.options).q); }},
    {"one_pose_at_a_time", one_pose_at_a_time},
};

}  // namespace
}  // namespace fastcal::bench

int main(int count, char** words) {
  using namespace fastcal::bench;
  if (count != 5) {
    std::fputs("serial_arms PASS MODEL LOAD REPETITIONS\n", stderr);
    return 2;
  }
  Task task(words[2], words[3]);
  for (const auto& [name, pass] : kPasses) {
    if (std::string("every") != words[1] && name != words[1]) continue;
    for (int k = std::stoi(words[4]); k > 0; --k) pass(task);
    double sum = 0;
    for (const double value : task.answer) sum += value * value;
    std::printf("%.17g\n", sum);
  }
}
