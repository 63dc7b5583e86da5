// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/identification/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fastcal/kernels/normal_sums.hpp"
#include "fastcal/math/check.hpp"
#include "fastcal/math/parallel.hpp"
#include "fastcal/model/row_block.hpp"

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
  return own == 0 ? common : std::sqrt(own * own + common * common);
}

/// Evaluates chunks of rows and writes them whitened, one measured number a row of the block, components apart.
class WhitenedRows {
 public:
  WhitenedRows(const Problem& problem, const Eigen::VectorXd& theta, const std::vector<int>& free,
               const Eigen::VectorXd& scale, const CommonNoise& tau)
      : problem_(problem),
        free_(free),
        scale_(scale),
        tau_(tau),
        block_(problem.model, theta.head(problem.model.parameter_count()), free, scale),
        anchors_(anchors_of(problem, theta)) {
    const Measurements& measured = problem.measured;
    const std::array<bool, kKinds> kinds{measured.position.size() > 0, measured.rotation.size() > 0,
                                         measured.distance.size() > 0};
    for (int c = 0; c < kComponents; ++c) {
      if (kinds[static_cast<std::size_t>(kind_of(c))]) numbers_.push_back(c);
    }
    points_only_ = !kinds[1] && !kinds[2];
    if (const LoadResponse* response = problem.response)
      along_ = response->directions.transpose() * (theta - response->origin);
  }

  /// Residuals and weights before a loss of rows begin ... end - 1.
  void evaluate(Eigen::Index begin, Eigen::Index end) {
    begin_ = begin;
    rows_ = static_cast<int>(end - begin);
    block_.forward(problem_.samples, begin, end, problem_.memory);
    const Eigen::Index stride = block_.stride();
    const auto count = static_cast<Eigen::Index>(numbers_.size());
    residual_.resize(count * stride);
    factor_.resize(count * stride);
    slope_.resize(6 * count * stride);
    std::fill(residual_.data(), residual_.data() + count * stride, 0.0);
    std::fill(factor_.data(), factor_.data() + count * stride, 0.0);
    if (!points_only_) std::fill(slope_.data(), slope_.data() + 6 * count * stride, 0.0);
    anchor_.assign(static_cast<std::size_t>(rows_), -1);
    weights_.assign(static_cast<std::size_t>(rows_), {});
    for (int i = 0; i < rows_; ++i) compare(i);
  }

  const RowWeight& weight(int i) const { return weights_[static_cast<std::size_t>(i)]; }

  /// Multiplies the numbers of row i once more.
  void weigh(int i, double factor) {
    for (std::size_t n = 0; n < numbers_.size(); ++n) at(factor_, n)[i] *= factor;
  }

  /// Residuals of row i as they are, NaN where not measured.
  template <typename Row>
  void raw(int i, Row out) const {
    for (std::size_t n = 0; n < numbers_.size(); ++n) {
      const auto k = static_cast<Eigen::Index>(n) * block_.stride() + i;
      if (factor_.data()[k] > 0) out[numbers_[n]] = residual_.data()[k];
    }
  }

  /// Rows and distance of columns of the block: [J r], one column after the other.
  int height() const { return static_cast<int>(numbers_.size()) * block_.stride(); }
  int ld() const { return height() + kernels::kGroup; }  // apart, so that columns do not meet in the cache

  double* jacobian() {
    const auto p = static_cast<Eigen::Index>(free_.size());
    double* J = J_.resize((p + 1) * ld());
    const int points = problem_.measured.position.size() > 0 ? 3 : 0;
    block_.jacobian({points > 0, static_cast<int>(numbers_.size()) - points, factor_.data(),
                     slope_.data() + 6 * points * block_.stride()},
                    J, ld());
    if (problem_.measured.anchor_count > 0) anchor_columns(J);
    if (along_.size() > 0) response_columns(J);
    Eigen::Map<Eigen::ArrayXd>(J + p * ld(), height()) = Eigen::Map<const Eigen::ArrayXd>(residual_.data(), height()) *
                                                         Eigen::Map<const Eigen::ArrayXd>(factor_.data(), height());
    return J;
  }

 private:
  double* at(AlignedNumbers& numbers, std::size_t n) {
    return numbers.data() + static_cast<Eigen::Index>(n) * block_.stride();
  }

  void compare(int i) {
    const Eigen::Index row = begin_ + i;
    if (!points_only_) {
      row_residual(problem_.measured, row, block_.tool(i), &anchors_, row_);
      anchor_[static_cast<std::size_t>(i)] = row_.anchor;
    }
    RowWeight& weight = weights_[static_cast<std::size_t>(i)];
    for (std::size_t n = 0; n < numbers_.size(); ++n) {
      const int c = numbers_[n];
      double r = points_only_ ? block_.position(i, c) - problem_.measured.position(row, c) : row_.r[c];
      if (points_only_ ? std::isnan(r) : !row_.present[static_cast<std::size_t>(c)]) continue;
      for (Eigen::Index k = 0; k < along_.size(); ++k)
        r += problem_.response->change[static_cast<std::size_t>(k)](row, c) * along_[k];
      const double inverse = 1 / deviation(problem_, tau_, row, c);
      at(residual_, n)[i] = r;
      at(factor_, n)[i] = inverse;
      weight.squared += r * r * inverse * inverse;
      ++weight.components;
      for (int k = 0; !points_only_ && k < 6; ++k)
        slope_.data()[(6 * static_cast<Eigen::Index>(n) + k) * block_.stride() + i] = row_.J_r_tool(c, k);
    }
  }

  /// d distance / d anchor is the opposite of its slope by the tool's position.
  void anchor_columns(double* J) {
    const std::size_t n = numbers_.size() - 1;
    const int p = problem_.model.parameter_count();
    for (std::size_t k = 0; k < free_.size(); ++k) {
      if (free_[k] < p) continue;
      double* out = J + static_cast<Eigen::Index>(k) * ld() + static_cast<Eigen::Index>(n) * block_.stride();
      const double* slope = slope_.data() + (6 * static_cast<Eigen::Index>(n) + (free_[k] - p) % 3) * block_.stride();
      for (int i = 0; i < rows_; ++i) {
        if (anchor_[static_cast<std::size_t>(i)] == (free_[k] - p) / 3)
          out[i] = -slope[i] * at(factor_, n)[i] * scale_[static_cast<Eigen::Index>(k)];
      }
    }
  }

  void response_columns(double* J) {
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const Eigen::VectorXd along =
          problem_.response->directions.row(free_[k]).transpose() * scale_[static_cast<Eigen::Index>(k)];
      double* out = J + static_cast<Eigen::Index>(k) * ld();
      for (std::size_t n = 0; n < numbers_.size(); ++n, out += block_.stride()) {
        for (int i = 0; i < rows_; ++i) {
          double sum = 0;
          for (Eigen::Index d = 0; d < along.size(); ++d)
            sum += problem_.response->change[static_cast<std::size_t>(d)](begin_ + i, numbers_[n]) * along[d];
          if (at(factor_, n)[i] != 0) out[i] += sum * at(factor_, n)[i];
        }
      }
    }
  }

  const Problem& problem_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& scale_;
  CommonNoise tau_;
  RowBlock block_;
  Eigen::Matrix3Xd anchors_;
  std::vector<int> numbers_;  // components that are measured anywhere
  bool points_only_ = false;
  Eigen::VectorXd along_;  // y of the response to loads; empty where there is none
  Eigen::Index begin_ = 0;
  int rows_ = 0;
  RowResidual row_;
  std::vector<RowWeight> weights_;
  std::vector<int> anchor_;
  AlignedNumbers residual_, factor_, slope_;  // (numbers, stride): r, 1 / deviation or 0; (numbers, 6, stride)
  AlignedNumbers J_;
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
    const auto worker = [&] { return WhitenedRows(problem, theta, free, scale, weighting.tau); };
    parallel_chunks(rows, problem.threads, worker,
                    [&](WhitenedRows& whitened, Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
                      const auto c = static_cast<std::size_t>(chunk);
                      whitened.evaluate(first + begin, first + end);
                      for (int i = 0; i < end - begin; ++i) {
                        const RowWeight& row = whitened.weight(i);
                        if (row.components == 0) continue;
                        const Loss& rho = *loss[static_cast<std::size_t>(row.components)];
                        costs[c] += 0.5 * rho.rho(row.squared);
                        const double weight = rho.weight(row.squared);
                        if (with_jacobian && weight != 1) whitened.weigh(i, std::sqrt(weight));
                      }
                      if (!with_jacobian) return;
                      parts[c] = Eigen::MatrixXd::Zero(p + 1, p + 1);
                      kernels::gram(whitened.jacobian(), whitened.ld(), whitened.height(), static_cast<int>(p) + 1,
                                    parts[c].data());
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
  const auto worker = [&] { return WhitenedRows(problem, theta, none, scale, {1, 1, 1}); };
  parallel_chunks(problem.row_count(), problem.threads, worker,
                  [&](WhitenedRows& rows, Eigen::Index, Eigen::Index begin, Eigen::Index end) {
                    rows.evaluate(begin, end);
                    for (Eigen::Index i = begin; i < end; ++i) rows.raw(static_cast<int>(i - begin), out.row(i));
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
  std::vector<Eigen::MatrixXd> factors(static_cast<std::size_t>(chunk_count(problem.row_count())));
  const auto worker = [&] { return WhitenedRows(problem, theta, free, scale, tau); };
  parallel_chunks(problem.row_count(), problem.threads, worker,
                  [&](WhitenedRows& whitened, Eigen::Index chunk, Eigen::Index begin, Eigen::Index end) {
                    whitened.evaluate(begin, end);
                    for (Eigen::Index i = begin; rows != nullptr && i < end; ++i) {
                      if (!((*rows)[static_cast<std::size_t>(i)].weight > 0))
                        whitened.weigh(static_cast<int>(i - begin), 0);
                    }
                    constexpr int kRows = 96;  // their columns stay in the first-level cache
                    Eigen::MatrixXd& R = factors[static_cast<std::size_t>(chunk)] = Eigen::MatrixXd::Zero(p, p);
                    double* J = whitened.jacobian();
                    for (int from = 0; from < whitened.height(); from += kRows) {
                      kernels::update_triangle(J + from, whitened.ld(), std::min(kRows, whitened.height() - from),
                                               static_cast<int>(p), R.data());
                    }
                  });
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(p, p);
  const Eigen::Index rows_of_factor = (p + kernels::kGroup - 1) / kernels::kGroup * kernels::kGroup;
  Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(rows_of_factor, p);
  for (const Eigen::MatrixXd& factor : factors) {
    padded.topRows(p) = factor;
    padded.bottomRows(rows_of_factor - p).setZero();
    kernels::update_triangle(padded.data(), static_cast<int>(rows_of_factor), static_cast<int>(rows_of_factor),
                             static_cast<int>(p), R.data());
  }
  return R;
}

}  // namespace fastcal
