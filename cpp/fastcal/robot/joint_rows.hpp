// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Joint positions of many postures, a table that may be large: a caller's array is read where it lies.
#pragma once

#include <memory>
#include <utility>

#include "fastcal/math/types.hpp"

namespace fastcal {

/// (N, n) numbers, its own or lent. What is lent stays as it is while `owner`, which every copy holds, lives.
class JointRows {
 public:
  using Table = Eigen::Map<const RowMatrixXd>;

  JointRows() = default;
  template <typename Derived>
  JointRows(const Eigen::DenseBase<Derived>& table) : own_(table) {}  // NOLINT(google-explicit-constructor)
  JointRows(const double* lent, Eigen::Index rows, Eigen::Index columns, std::shared_ptr<const void> owner)
      : lent_(lent), rows_(rows), columns_(columns), owner_(std::move(owner)) {}

  Eigen::Index rows() const { return lent_ == nullptr ? own_.rows() : rows_; }
  Eigen::Index cols() const { return lent_ == nullptr ? own_.cols() : columns_; }
  Eigen::Index size() const { return rows() * cols(); }
  const double* data() const { return lent_ == nullptr ? own_.data() : lent_; }
  const double* row(Eigen::Index i) const { return data() + i * cols(); }
  double operator()(Eigen::Index i, Eigen::Index j) const { return row(i)[j]; }
  Table table() const { return {data(), rows(), cols()}; }

  /// To write into: what is lent is copied first.
  RowMatrixXd& own() {
    if (lent_ != nullptr) *this = JointRows(table());
    return own_;
  }

 private:
  RowMatrixXd own_;
  const double* lent_ = nullptr;
  Eigen::Index rows_ = 0, columns_ = 0;
  std::shared_ptr<const void> owner_;
};

}  // namespace fastcal
