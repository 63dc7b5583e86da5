// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// 5,000 corners of one board in two cameras on the flange, and 60 unknowns: 24 of the arm, each camera's placement and
// nine numbers of its lens, the board's placement. A pass over all corners with derivatives, and the whole solve,
// beside what an engineer would write with Ceres: no gauge, covariance or loss.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <numeric>

#include "corner_peers.hpp"
#include "fastcal/identification/identify.hpp"
#include "fastcal/model/prediction.hpp"
#include "scene.hpp"

namespace fastcal::bench {
namespace {

constexpr double kNoise = 0.05, kCentre = 800;  // [px]
constexpr double kSpread = 0.5;                 // [rad] of the joints

struct Pictures {
  ErrorModel model;
  View view;
  Samples samples = Samples();
  Measurements measured{};
  std::vector<int> asked{};
  RowMatrixXd uv{};

  Problem problem() const { return {model, samples, measured, 1}; }
};

Eigen::VectorXd nothing(const Pictures& of) { return Eigen::VectorXd::Zero(of.measured.unknown_count()); }

IdentifyOptions plain() {
  IdentifyOptions out;
  out.loss = LossKind::kNone;
  return out;
}

Rig rig(const View& view) {
  Rig out;
  for (int k = 0; k < kCameras; ++k) {
    Camera camera{{"camera" + std::to_string(k), link_frame(5), view.T_flange_camera[k]}, LensModel::kPinhole};
    camera.intrinsics.head<kLens>() = view.lens[k];
    camera.identified_intrinsics = kLens;
    out.cameras.push_back(camera);
  }
  out.boards.push_back({{"board", kWorldFrame, view.T_world_board}, view.corners});
  return out;
}

/// Postures near `middle` in which both cameras see the whole board.
RowMatrixXd postures(View view, const Eigen::VectorXd& middle) {
  test::Random random(5);
  RowMatrixXd out(kRows, 6);
  for (Eigen::Index i = 0; i < kRows;) {
    view.q = (middle + random.values(6, kSpread)).transpose();
    const RowMatrixXd uv = drawn(view, Unknowns::Zero());
    if (((uv.array() - kCentre).abs() < kCentre).all()) out.row(i++) = view.q.row(0);  // NaN is none
  }
  return out;
}

View looking() {
  test::Random random(3);
  View out;
  out.free.resize(kGeometry);
  std::iota(out.free.begin(), out.free.end(), 0);
  for (int k = 0; k < kCameras; ++k) {
    out.T_flange_camera[k] = {exp_so3(random.normals(0.05)), Eigen::Vector3d(0.1 * k - 0.05, 0.02, 0.06)};
    out.lens[k] << 1400, 1402, kCentre, kCentre - 10, -0.11, 0.09, 2e-4, -3e-4, 0.01;
  }
  out.corners = Eigen::Matrix3Xd::Zero(3, kCorners);
  for (int k = 0; k < kCorners; ++k) out.corners.col(k) << 0.02 * (k % 10) - 0.09, 0.02 * (k / 10) - 0.04, 0;
  Eigen::VectorXd middle(6);
  middle << 0.2, -0.4, 0.3, 0.4, 0.9, 0.1;
  const RobotModel robot = test::build("dh", test::six_axes());
  const ErrorModel nominal(robot, {}, Eigen::VectorXd());
  Samples one;
  one.q = RowMatrixXd(middle.transpose());
  std::array<double, 16> T{};
  predict(nominal, one, nominal.start(), 1, T.data());
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> tool(T.data());
  const Pose flange = Pose{tool.topLeftCorner<3, 3>(), tool.topRightCorner<3, 1>()} * test::six_axes().tool.inverse();
  out.T_world_board = flange * Pose{exp_so3(Eigen::Vector3d(0.3, -0.2, 0.1)), Eigen::Vector3d(0, 0, 0.5)};
  out.q = postures(out, middle);
  return out;
}

/// Pictures with noise of an arm, cameras and a board that are all a little off.
const Pictures& pictures() {
  static const Pictures made = [] {
    Pictures out{arm(true), looking()};
    for (int k = 6; k < 36; ++k) out.asked.push_back(k);
    for (int k = 42; k < 48; ++k) out.asked.push_back(k);
    test::Random random(9);
    Unknowns truth = random.values(kUnknowns, 1e-3);
    for (int k = 0; k < kCameras; ++k) truth.segment<4>(kGeometry + k * (kStanding + kLens) + kStanding) *= 1e3;
    RowMatrixXd uv = drawn(out.view, truth);
    for (Eigen::Index i = 0; i < uv.size(); ++i) uv.data()[i] += random.normals(kNoise)[0];
    out.samples.q = out.view.q;
    out.measured = Measurements({kRows, {{"corner", uv}}, {}, rig(out.view)}, out.model.robot());
    out.view.free.clear();
    for (const int k : identify(out.problem(), out.asked, nothing(out), plain()).free) {
      if (k < out.model.parameter_count()) out.view.free.push_back(k < 36 ? k - 6 : k - 12);
    }
    out.uv = uv;
    return out;
  }();
  return made;
}

void report(benchmark::State& state, double rms, int passes) {
  state.counters["rms_px"] = rms;
  state.counters["passes"] = passes;
}

void fastcal_passes(benchmark::State& state) {
  const Pictures& p = pictures();
  std::vector<int> free = p.asked;
  for (int k = 0; k < p.measured.unknown_count(); ++k) free.push_back(p.model.parameter_count() + k);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(p.problem().parameter_count());
  theta.head(p.model.parameter_count()) = p.model.start();
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(free.size()), 1e-3);
  for (auto _ : state)
    benchmark::DoNotOptimize(normal_equations(p.problem(), theta, free, scale, {{kNoise}, LossKind::kNone}, true).cost);
}
BENCHMARK(fastcal_passes)->Unit(benchmark::kMillisecond);

void fastcal_solves(benchmark::State& state) {
  const Pictures& p = pictures();
  Identification found;
  for (auto _ : state) found = identify(p.problem(), p.asked, nothing(p), plain());
  report(state, std::sqrt(found.residuals.squaredNorm() / static_cast<double>(found.residuals.size())),
         found.iterations);
}
BENCHMARK(fastcal_solves)->Unit(benchmark::kMillisecond);

void ceres_solves(benchmark::State& state, Derivatives derivatives) {
  const Pictures& p = pictures();
  Solved found;
  for (auto _ : state) found = solve_with_ceres(p.view, p.uv, derivatives);
  report(state, found.rms, found.iterations);
}
BENCHMARK_CAPTURE(ceres_solves, automatic, Derivatives::kAutomatic)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(ceres_solves, written_out, Derivatives::kWrittenOut)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace fastcal::bench
