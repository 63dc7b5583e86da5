// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "elementary_motions.hpp"

#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "support/robots.hpp"

namespace fastcal::bench {
namespace {

constexpr int kFree = 33;  // what points of this arm show: 27 of base, geometry and tool, 6 ratios
constexpr int kMotions = 39;
constexpr int kFirstRatio = kMotions + 3;  // behind the turns of the tool, which points don't show
constexpr int kParameters = kFirstRatio + 6;

struct Motion {
  bool turns = false;
  int axis = 0;
  double nominal = 0;
  int joint = -1;  // whose position is added
};

/// Base, rows of theta d a alpha beta, tool point; motion m has parameter m.
std::vector<Motion> motions() {
  const test::Tables arm = test::six_axes();
  std::vector<Motion> out;
  for (const bool turns : {false, true}) {
    for (int axis = 0; axis < 3; ++axis) out.push_back({turns, axis});
  }
  for (int j = 0; j < 6; ++j) {
    out.push_back({true, 2, arm.rows(j, 0), j});
    out.push_back({false, 2, arm.rows(j, 1)});
    out.push_back({false, 0, arm.rows(j, 2)});
    out.push_back({true, 0, arm.rows(j, 3)});
    out.push_back({true, 1, arm.rows(j, 4)});
  }
  for (int axis = 0; axis < 3; ++axis) out.push_back({false, axis, arm.tool.p[axis]});
  return out;
}

/// p behind a motion, seen from before it.
template <typename T>
void apply(const Motion& motion, const T& value, T* p) {
  if (!motion.turns) {
    p[motion.axis] += value;
    return;
  }
  const int u = (motion.axis + 1) % 3;
  const int v = (motion.axis + 2) % 3;
  const T c = cos(value);
  const T s = sin(value);
  const T before = p[u];
  p[u] = c * before - s * p[v];
  p[v] = s * before + c * p[v];
}

struct Row {
  const std::vector<Motion>& chain;
  const std::vector<int>& free;
  const double* q;
  const double* measured;

  /// Of each motion.
  template <typename T>
  std::array<T, kMotions> values(const T* x) const {
    std::array<T, kParameters> parameter;
    parameter.fill(T(0.0));
    for (std::size_t k = 0; k < kFree; ++k) parameter[static_cast<std::size_t>(free[k])] = x[k];
    std::array<T, kMotions> out;
    for (std::size_t m = 0; m < kMotions; ++m) {
      const Motion& motion = chain[m];
      out[m] = parameter[m] + motion.nominal;
      if (motion.joint >= 0)
        out[m] += (1.0 + parameter[kFirstRatio + static_cast<std::size_t>(motion.joint)]) * q[motion.joint];
    }
    return out;
  }

  template <typename T>
  bool operator()(const T* x, T* r) const {
    using std::cos;
    using std::sin;
    const std::array<T, kMotions> value = values(x);
    r[0] = r[1] = r[2] = T(0.0);
    for (std::size_t m = kMotions; m-- > 0;) apply(chain[m], value[m], r);
    for (int k = 0; k < 3; ++k) r[k] -= measured[k];
    return true;
  }
};

/// d p / d value of a shift is its axis, of a turn its axis times the point behind it, both turned by all before.
class WrittenOut : public ceres::SizedCostFunction<3, kFree> {
 public:
  explicit WrittenOut(const Row& row) : row_(row) {}

  bool Evaluate(double const* const* x, double* r, double** J) const override {
    const std::array<double, kMotions> value = row_.values(x[0]);
    std::array<Eigen::Vector3d, kMotions> behind;
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (std::size_t m = kMotions; m-- > 0;) {
      apply(row_.chain[m], value[m], p.data());
      behind[m] = p;
    }
    Eigen::Map<Eigen::Vector3d>{r} = p - Eigen::Map<const Eigen::Vector3d>(row_.measured);
    if (J == nullptr || J[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 3, kFree, Eigen::RowMajor>> slopes(J[0]);
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Index k = 0;
    for (std::size_t m = 0; m < kMotions; ++m) {
      const Motion& motion = row_.chain[m];
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(motion.axis);
      const Eigen::Vector3d slope = R * (motion.turns ? axis.cross(behind[m]) : axis);
      if (row_.free[static_cast<std::size_t>(k)] == static_cast<int>(m)) slopes.col(k++) = slope;
      if (motion.joint >= 0) slopes.col(kFree - 6 + motion.joint) = row_.q[motion.joint] * slope;
      if (motion.turns) R = R * Eigen::AngleAxisd(value[m], axis);
    }
    return true;
  }

 private:
  Row row_;
};

}  // namespace

double solve_with_ceres(const RowMatrixXd& q, const RowMatrixXd& p, const std::vector<int>& free,
                        Derivatives derivatives) {
  if (free.size() != kFree || free[kFree - 7] >= kMotions || free[kFree - 6] != kFirstRatio)
    throw std::invalid_argument("the peers are written for " + std::to_string(kFree - 6) + " sizes and six ratios");
  const std::vector<Motion> chain = motions();
  std::array<double, kFree> x{};
  ceres::Problem problem;
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    const Row row{chain, free, q.row(i).data(), p.row(i).data()};
    ceres::CostFunction* cost = nullptr;
    if (derivatives == Derivatives::kWrittenOut)
      cost = new WrittenOut(row);
    else
      cost = new ceres::AutoDiffCostFunction<Row, 3, kFree>(new Row(row));
    problem.AddResidualBlock(cost, nullptr, x.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return std::sqrt(2 * summary.final_cost / static_cast<double>(p.size()));
}

}  // namespace fastcal::bench
