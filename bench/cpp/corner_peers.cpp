// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "corner_peers.hpp"

#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "support/robots.hpp"

namespace fastcal::bench {
namespace {

constexpr int kSizes = 30, kChain = kSizes, kSteps = kStanding + kChain + kStanding;
constexpr double kNearest = 0.05;  // [m] before the camera

/// A turn about or a shift along an own axis, forwards or back.
struct Step {
  bool turns = false;
  int axis = 0;
  bool back = false;
  double nominal = 0;
  int joint = -1;  // whose position is added
};

/// From a corner in the board's frame to the camera: the board's own placement (its nominal pose follows), the arm back
/// (the camera's nominal pose, back, follows), and the camera's own placement back.
std::array<Step, kSteps> steps() {
  const test::Tables arm = test::six_axes();
  std::array<Step, kSteps> out;
  std::size_t k = 0;
  for (const bool turns : {true, false}) {
    for (int axis = 3; axis-- > 0;) out[k++] = {turns, axis, false, 0, -1};
  }
  for (int j = 0; j < 6; ++j) {
    out[k++] = {true, 2, true, arm.rows(j, 0), j};
    out[k++] = {false, 2, true, arm.rows(j, 1), -1};
    out[k++] = {false, 0, true, arm.rows(j, 2), -1};
    out[k++] = {true, 0, true, arm.rows(j, 3), -1};
    out[k++] = {true, 1, true, arm.rows(j, 4), -1};
  }
  for (const bool turns : {false, true}) {
    for (int axis = 0; axis < 3; ++axis) out[k++] = {turns, axis, true, 0, -1};
  }
  return out;
}

template <typename T>
void apply(const Step& step, const T& value, T* p) {
  if (!step.turns) {
    p[step.axis] += step.back ? -value : value;
    return;
  }
  const int u = (step.axis + 1) % 3, v = (step.axis + 2) % 3;
  const T c = cos(value);
  const T s = step.back ? T(-sin(value)) : T(sin(value));
  const T before = p[u];
  p[u] = c * before - s * p[v];
  p[v] = s * before + c * p[v];
}

template <typename T>
void apply(const Pose& pose, T* p) {
  const std::array<T, 3> at{p[0], p[1], p[2]};
  for (int i = 0; i < 3; ++i) p[i] = pose.R(i, 0) * at[0] + pose.R(i, 1) * at[1] + pose.R(i, 2) * at[2] + pose.p[i];
}

struct Corner {
  const View& view;
  const std::array<Step, kSteps>& chain;
  Eigen::Index row = 0;
  int camera = 0;
  int corner = 0;
  Pose T_camera_flange;
  Eigen::Vector2d seen;

  template <typename T>
  std::array<T, kSteps> values(const T* geometry, const T* standing, const T* board) const {
    std::array<T, kSizes + 6> parameter;
    parameter.fill(T(0.0));
    for (std::size_t k = 0; k < kGeometry; ++k) parameter[static_cast<std::size_t>(view.free[k])] = geometry[k];
    std::array<T, kSteps> out;
    for (std::size_t m = 0; m < kStanding; ++m) {
      out[m] = board[m];
      out[kStanding + kChain + m] = standing[m];
    }
    for (std::size_t m = 0; m < kChain; ++m) {
      const Step& step = chain[kStanding + m];
      out[kStanding + m] = parameter[m] + step.nominal;
      if (step.joint >= 0)
        out[kStanding + m] +=
            (1.0 + parameter[static_cast<std::size_t>(kSizes + step.joint)]) * view.q(row, step.joint);
    }
    return out;
  }

  /// To the camera; `at` is called with each step and the point behind it.
  template <typename T, typename At>
  void carry(const std::array<T, kSteps>& value, T* p, const At& at) const {
    for (std::size_t m = 0; m < kSteps; ++m) {
      apply(chain[m], value[m], p);
      at(m, p);
      if (m == kStanding - 1) apply(view.T_world_board, p);
      if (m == kStanding + kChain - 1) apply(T_camera_flange, p);
    }
  }

  template <typename T>
  void draw(const T* p, const T* change, T* uv) const {
    std::array<T, kLens> lens;
    for (int k = 0; k < kLens; ++k) lens[static_cast<std::size_t>(k)] = view.lens[camera][k] + change[k];
    const T x = p[0] / p[2], y = p[1] / p[2], s = x * x + y * y;
    const T a = 1.0 + s * (lens[4] + s * (lens[5] + s * lens[8]));
    uv[0] = lens[0] * (a * x + 2.0 * lens[6] * x * y + lens[7] * (s + 2.0 * x * x)) + lens[2];
    uv[1] = lens[1] * (a * y + lens[6] * (s + 2.0 * y * y) + 2.0 * lens[7] * x * y) + lens[3];
  }

  /// `camera_x`: its placement, then its lens.
  template <typename T>
  bool operator()(const T* geometry, const T* camera_x, const T* board, T* r) const {
    using std::cos;
    using std::sin;
    std::array<T, 3> p{T(view.corners(0, corner)), T(view.corners(1, corner)), T(view.corners(2, corner))};
    carry(values(geometry, camera_x, board), p.data(), [](std::size_t, const T*) {});
    draw(p.data(), camera_x + kStanding, r);
    r[0] -= seen[0];
    r[1] -= seen[1];
    return true;
  }
};

/// d p / d value of a shift is its axis, of a turn its axis times the point behind it, turned by all that follows; with
/// the minus sign where it goes back.
class WrittenOut : public ceres::SizedCostFunction<2, kGeometry, kStanding + kLens, kStanding> {
 public:
  explicit WrittenOut(const Corner& of) : of_(of) {
    where_.fill(-1);
    for (int k = 0; k < kGeometry; ++k)
      where_[static_cast<std::size_t>(of_.view.free[static_cast<std::size_t>(k)])] = k;
  }

  bool Evaluate(double const* const* x, double* r, double** J) const override {
    const std::array<double, kSteps> value = of_.values(x[0], x[1], x[2]);
    std::array<Eigen::Vector3d, kSteps> behind;
    Eigen::Vector3d p = of_.view.corners.col(of_.corner);
    of_.carry(value, p.data(),
              [&](std::size_t m, const double* at) { behind[m] = Eigen::Map<const Eigen::Vector3d>(at); });
    of_.draw(p.data(), x[1] + kStanding, r);
    Eigen::Map<Eigen::Vector2d>{r} -= of_.seen;
    if (J == nullptr) return true;
    const Eigen::Map<const Eigen::Matrix<double, kLens, 1>> change(x[1] + kStanding);
    const Eigen::Matrix<double, kLens, 1> lens = of_.view.lens[of_.camera] + change;
    const double X = p[0] / p[2], Y = p[1] / p[2], s = X * X + Y * Y;
    const double a = 1 + s * (lens[4] + s * (lens[5] + s * lens[8]));
    const double da = lens[4] + s * (2 * lens[5] + 3 * s * lens[8]);  // by s
    const double off = 2 * X * Y * da + 2 * lens[6] * X + 2 * lens[7] * Y;
    Eigen::Matrix2d by_direction;
    by_direction << lens[0] * (a + 2 * X * X * da + 2 * lens[6] * Y + 6 * lens[7] * X), lens[0] * off, lens[1] * off,
        lens[1] * (a + 2 * Y * Y * da + 6 * lens[6] * Y + 2 * lens[7] * X);
    Eigen::Matrix<double, 2, 3> slope;  // of the picture by the point behind a step
    slope << by_direction, -by_direction * Eigen::Vector2d(X, Y);
    slope /= p[2];
    constexpr int kRowMajor = Eigen::RowMajor;
    if (J[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, kStanding + kLens, kRowMajor>> by(J[1]);
      by.rightCols<kLens>().setZero();
      const double u = a * X + 2 * lens[6] * X * Y + lens[7] * (s + 2 * X * X);
      const double v = a * Y + lens[6] * (s + 2 * Y * Y) + 2 * lens[7] * X * Y;
      by(0, 6) = u;
      by(1, 7) = v;
      by(0, 8) = by(1, 9) = 1;
      const Eigen::Vector2d f(lens[0] * X, lens[1] * Y);
      by.col(10) = f * s;
      by.col(11) = f * s * s;
      by.col(12) << lens[0] * 2 * X * Y, lens[1] * (s + 2 * Y * Y);
      by.col(13) << lens[0] * (s + 2 * X * X), lens[1] * 2 * X * Y;
      by.col(14) = f * s * s * s;
    }
    for (std::size_t m = kSteps; m-- > 0;) {
      const Step& step = of_.chain[m];
      if (m == kStanding + kChain - 1) slope = slope * of_.T_camera_flange.R;
      if (m == kStanding - 1) slope = slope * of_.view.T_world_board.R;
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(step.axis);
      const Eigen::Vector2d by = (step.back ? -1 : 1) * slope * (step.turns ? axis.cross(behind[m]) : axis);
      if (m >= kStanding + kChain)
        put<kStanding + kLens>(J[1], static_cast<int>(m) - kStanding - kChain, by);
      else if (m < kStanding)
        put<kStanding>(J[2], static_cast<int>(m), by);
      else {
        put<kGeometry>(J[0], where_[m - kStanding], by);
        if (step.joint >= 0) {
          const auto ratio = static_cast<std::size_t>(kSizes + step.joint);
          put<kGeometry>(J[0], where_[ratio], of_.view.q(of_.row, step.joint) * by);
        }
      }
      if (step.turns) slope = slope * Eigen::AngleAxisd(step.back ? -value[m] : value[m], axis).toRotationMatrix();
    }
    return true;
  }

 private:
  template <int kColumns>
  static void put(double* J, int column, const Eigen::Vector2d& by) {
    if (J == nullptr || column < 0) return;
    J[column] = by[0];
    J[kColumns + column] = by[1];
  }

  Corner of_;
  std::array<int, kSizes + 6> where_{};
};

/// Where a camera's numbers, and the board's, are among the unknowns.
int place_of(int camera) { return kGeometry + camera * (kStanding + kLens); }

std::vector<Corner> corners_of(const View& view, const std::array<Step, kSteps>& chain) {
  if (view.free.size() != kGeometry)
    throw std::invalid_argument("the peers are written for " + std::to_string(kGeometry) + " numbers of the arm, got " +
                                std::to_string(view.free.size()));
  std::vector<Corner> out;
  for (Eigen::Index i = 0; i < view.q.rows(); ++i) {
    for (int camera = 0; camera < kCameras; ++camera) {
      for (int k = 0; k < kCorners; ++k)
        out.push_back({view, chain, i, camera, k, view.T_flange_camera[camera].inverse(), Eigen::Vector2d::Zero()});
    }
  }
  return out;
}

}  // namespace

RowMatrixXd drawn(const View& view, const Unknowns& x) {
  const std::array<Step, kSteps> chain = steps();
  RowMatrixXd out(view.q.rows(), 2 * kCameras * kCorners);
  const double* board = x.data() + place_of(kCameras);
  for (const Corner& of : corners_of(view, chain)) {
    const double* own = x.data() + place_of(of.camera);
    Eigen::Vector3d p = view.corners.col(of.corner);
    of.carry(of.values(x.data(), own, board), p.data(), [](std::size_t, const double*) {});
    Eigen::Vector2d uv;
    of.draw(p.data(), own + kStanding, uv.data());
    if (p.z() < kNearest) uv.setConstant(std::numeric_limits<double>::quiet_NaN());
    out.row(of.row).segment<2>(2 * (of.camera * kCorners + of.corner)) = uv.transpose();
  }
  return out;
}

Solved solve_with_ceres(const View& view, const RowMatrixXd& uv, Derivatives derivatives) {
  const std::array<Step, kSteps> chain = steps();
  Unknowns x = Unknowns::Zero();
  ceres::Problem problem;
  for (Corner& of : corners_of(view, chain)) {
    of.seen = uv.row(of.row).segment<2>(2 * (of.camera * kCorners + of.corner)).transpose();
    ceres::CostFunction* cost = nullptr;
    if (derivatives == Derivatives::kWrittenOut)
      cost = new WrittenOut(of);
    else
      cost = new ceres::AutoDiffCostFunction<Corner, 2, kGeometry, kStanding + kLens, kStanding>(new Corner(of));
    problem.AddResidualBlock(cost, nullptr, x.data(), x.data() + place_of(of.camera), x.data() + place_of(kCameras));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return {std::sqrt(2 * summary.final_cost / static_cast<double>(uv.size())), summary.num_jacobian_evaluations};
}

}  // namespace fastcal::bench
