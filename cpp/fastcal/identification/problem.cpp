// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/problem.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"

namespace fastcal {
namespace {

/// Reads anchors out of theta's tail.
Eigen::Matrix3Xd anchors_of(const Problem& problem, const Eigen::VectorXd& theta) {
  return Eigen::Map<const Eigen::Matrix3Xd>(theta.data() + problem.model.parameter_count(), 3,
                                            problem.measured.anchor_count);
}

double deviation(const Problem& problem, const CommonNoise& tau, Eigen::Index i, int component) {
  const double own = problem.measured.sigma(i, component);
  const double common = tau[static_cast<std::size_t>(kind_of(component))];
  return std::hypot(own, common);
}

/// Evaluates rows one by one and writes them whitened.
class WhitenedRows {
 public:
  WhitenedRows(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
               const Eigen::VectorXd& scale, const CommonNoise& tau)
      : problem_(problem),
        free_(free),
        scale_(scale),
        tau_(tau),
        evaluator_(problem.model, theta.head(problem.model.parameter_count())),
        anchors_(anchors_of(problem, theta)),
        J_tool_(6, problem.model.parameter_count()) {
    if (const LoadResponse* response = problem.response)
      along_ = response->directions.transpose() * (theta - response->origin);
  }

  /// u^2 and d of row i.
  RowWeight residual(Eigen::Index i) {
    row_residual(problem_.measured, i, evaluator_.pose(problem_.samples.row(i)), &anchors_, row_);
    respond(i);
    return whiten(i);
  }

  /// The same, and its d rows [J r] appended to `block` from row `at` on; d rows are written.
  RowWeight rows(Eigen::Index i, Eigen::Ref<RowMatrixXd> block, Eigen::Index at) {
    const Pose& T = evaluator_.jacobian(problem_.samples.row(i), J_tool_);
    row_residual(problem_.measured, i, T, &anchors_, row_);
    respond(i);
    const RowWeight out = whiten(i);
    const Eigen::Index p = block.cols() - 1;
    for (int c = 0; c < kComponents; ++c) {
      if (!row_.present[static_cast<std::size_t>(c)]) continue;
      const double inverse = 1 / deviations_[static_cast<std::size_t>(c)];
      for (Eigen::Index k = 0; k < p; ++k)
        block(at, k) = derivative(i, c, free_[static_cast<std::size_t>(k)]) * scale_[k] * inverse;
      block(at, p) = row_.r[c] * inverse;
      ++at;
    }
    return out;
  }

  const RowResidual& raw() const { return row_; }

 private:
  RowWeight whiten(Eigen::Index i) {
    RowWeight out;
    for (int c = 0; c < kComponents; ++c) {
      if (!row_.present[static_cast<std::size_t>(c)]) continue;
      const double s = deviation(problem_, tau_, i, c);
      deviations_[static_cast<std::size_t>(c)] = s;
      out.squared += row_.r[c] * row_.r[c] / (s * s);
      ++out.components;
    }
    return out;
  }

  /// Adds to the residuals of row i what its loads' change does.
  void respond(Eigen::Index i) {
    for (Eigen::Index k = 0; k < along_.size(); ++k) {
      for (int c = 0; c < kComponents; ++c) {
        if (row_.present[static_cast<std::size_t>(c)])
          row_.r[c] += problem_.response->change[static_cast<std::size_t>(k)](i, c) * along_[k];
      }
    }
  }

  double derivative(Eigen::Index i, int component, int parameter) const {
    double out = derivative(component, parameter);
    for (Eigen::Index k = 0; k < along_.size(); ++k)
      out += problem_.response->change[static_cast<std::size_t>(k)](i, component) *
             problem_.response->directions(parameter, k);
    return out;
  }

  double derivative(int component, int parameter) const {
    const int p = problem_.model.parameter_count();
    if (parameter < p) {
      if (component < 3) return J_tool_(component, parameter);
      return row_.J_r_tool.row(component).dot(J_tool_.col(parameter));
    }
    const int anchor = (parameter - p) / 3;
    return component == 6 && anchor == row_.anchor ? row_.J_distance_anchor[(parameter - p) % 3] : 0;
  }

  const Problem& problem_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& scale_;
  CommonNoise tau_;
  RowEvaluator evaluator_;
  Eigen::Matrix3Xd anchors_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> J_tool_;
  RowResidual row_;
  Eigen::VectorXd along_;  // y of the response to loads; empty where there is none
  std::array<double, kComponents> deviations_{};
};

std::array<const Loss*, kComponents + 1> losses(LossKind kind) {
  std::array<const Loss*, kComponents + 1> out{};
  for (int d = 1; d <= kComponents; ++d) out[static_cast<std::size_t>(d)] = &tuned_loss(kind, d);
  return out;
}

}  // namespace

void Problem::check() const {
  samples.check(model.robot().joint_count());
  measured.check(samples.count());
  FASTCAL_CHECK(samples.count() > 0) << "there are no rows";
}

NormalEquations normal_equations(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                 const Eigen::VectorXd& scale, const Weighting& weighting, bool with_jacobian) {
  const auto p = static_cast<Eigen::Index>(free.size());
  const auto loss = losses(weighting.loss);
  NormalEquations sum;
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(p + 1, p + 1);
  // Groups of chunks bound the memory; within a group the chunks are summed in their order, whoever worked on them.
  constexpr Eigen::Index kGroupChunks = 128;
  for (Eigen::Index first = 0; first < problem.row_count(); first += kGroupChunks * kChunkRows) {
    const Eigen::Index rows = std::min(problem.row_count() - first, kGroupChunks * kChunkRows);
    std::vector<Eigen::MatrixXd> parts(static_cast<std::size_t>(chunk_count(rows)));
    std::vector<double> costs(parts.size(), 0.0);
    parallel_chunks(rows, problem.threads, [&](Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
      WhitenedRows whitened(problem, theta, free, scale, weighting.tau);
      const auto c = static_cast<std::size_t>(chunk);
      RowMatrixXd block =
          with_jacobian ? RowMatrixXd(problem.measured.components() * (end - begin), p + 1) : RowMatrixXd();
      Eigen::Index used = 0;
      for (Eigen::Index i = first + begin; i < first + end; ++i) {
        const RowWeight row = with_jacobian ? whitened.rows(i, block, used) : whitened.residual(i);
        if (row.components == 0) continue;
        const Loss& rho = *loss[static_cast<std::size_t>(row.components)];
        costs[c] += 0.5 * rho.rho(row.squared);
        if (with_jacobian) {
          const double root = std::sqrt(rho.weight(row.squared));
          if (root != 1) block.middleRows(used, row.components) *= root;
          used += row.components;
        }
      }
      if (with_jacobian) {
        parts[c] = Eigen::MatrixXd::Zero(p + 1, p + 1);
        parts[c].selfadjointView<Eigen::Upper>().rankUpdate(block.topRows(used).transpose());
      }
    });
    for (std::size_t c = 0; c < parts.size(); ++c) {
      sum.cost += costs[c];
      if (with_jacobian) total += parts[c];
    }
  }
  if (with_jacobian) {
    sum.A = total.topLeftCorner(p, p).selfadjointView<Eigen::Upper>();
    sum.g = total.topRightCorner(p, 1);
  }
  return sum;
}

RowMatrixXd residuals(const Problem& problem, const Eigen::VectorXd& theta) {
  RowMatrixXd out = RowMatrixXd::Constant(problem.row_count(), kComponents, std::numeric_limits<double>::quiet_NaN());
  const std::vector<int> none;
  const Eigen::VectorXd scale;
  parallel_chunks(problem.row_count(), problem.threads, [&](Eigen::Index, Eigen::Index begin, Eigen::Index end) {
    WhitenedRows rows(problem, theta, none, scale, {1, 1, 1});
    for (Eigen::Index i = begin; i < end; ++i) {
      rows.residual(i);
      for (int c = 0; c < kComponents; ++c) {
        if (rows.raw().present[static_cast<std::size_t>(c)]) out(i, c) = rows.raw().r[c];
      }
    }
  });
  return out;
}

std::vector<RowWeight> row_weights(const Problem& problem, const RowMatrixXd& residuals, const Weighting& weighting) {
  const auto loss = losses(weighting.loss);
  std::vector<RowWeight> out(static_cast<std::size_t>(residuals.rows()));
  for (Eigen::Index i = 0; i < residuals.rows(); ++i) {
    RowWeight& row = out[static_cast<std::size_t>(i)];
    for (int c = 0; c < kComponents; ++c) {
      if (std::isnan(residuals(i, c))) continue;
      const double u = residuals(i, c) / deviation(problem, weighting.tau, i, c);
      row.squared += u * u;
      ++row.components;
    }
    row.weight = row.components == 0 ? 0 : loss[static_cast<std::size_t>(row.components)]->weight(row.squared);
  }
  return out;
}

Eigen::MatrixXd triangular_factor(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
                                  const Eigen::VectorXd& scale, const CommonNoise& tau,
                                  const std::vector<RowWeight>* rows) {
  const auto p = static_cast<Eigen::Index>(free.size());
  const Eigen::Index chunks = chunk_count(problem.row_count());
  std::vector<Eigen::MatrixXd> factors(static_cast<std::size_t>(chunks));
  const auto triangle = [p](const Eigen::MatrixXd& M) {
    Eigen::MatrixXd R = Eigen::MatrixXd::Zero(p, p);
    const Eigen::Index k = std::min(p, M.rows());
    R.topRows(k) = Eigen::HouseholderQR<Eigen::MatrixXd>(M).matrixQR().topRows(k).triangularView<Eigen::Upper>();
    return R;
  };
  parallel_chunks(problem.row_count(), problem.threads, [&](Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
    WhitenedRows whitened(problem, theta, free, scale, tau);
    RowMatrixXd block(problem.measured.components() * (end - begin), p + 1);
    Eigen::Index used = 0;
    for (Eigen::Index i = begin; i < end; ++i) {
      if (rows != nullptr && !((*rows)[static_cast<std::size_t>(i)].weight > 0)) continue;
      used += whitened.rows(i, block, used).components;
    }
    factors[static_cast<std::size_t>(chunk)] = triangle(block.topLeftCorner(used, p));
  });
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(p, p);
  for (const Eigen::MatrixXd& factor : factors) {
    Eigen::MatrixXd stacked(2 * p, p);
    stacked << R, factor;
    R = triangle(stacked);
  }
  return R;
}

}  // namespace fastcal
