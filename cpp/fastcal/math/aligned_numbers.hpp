// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Numbers at addresses that a vector register likes. Every pass over the rows takes the same few arrays: what is given
// back stays with the thread for the next pass, up to a megabyte.
#pragma once

#include <Eigen/Core>
#include <utility>

namespace fastcal {

class AlignedNumbers {
 public:
  AlignedNumbers() = default;
  AlignedNumbers(AlignedNumbers&& other) noexcept
      : numbers_(std::exchange(other.numbers_, nullptr)), count_(std::exchange(other.count_, 0)) {}
  AlignedNumbers& operator=(AlignedNumbers&& other) noexcept {
    std::swap(numbers_, other.numbers_);
    std::swap(count_, other.count_);
    return *this;
  }
  ~AlignedNumbers() { give_back(); }

  /// At least `count` of them, to be written before they are read; what was there is lost where they were fewer.
  double* resize(Eigen::Index count) {
    if (count > count_) {
      give_back();
      take(count);
    }
    return numbers_;
  }
  double* data() { return numbers_; }
  const double* data() const { return numbers_; }

 private:
  void take(Eigen::Index count);
  void give_back();

  double* numbers_ = nullptr;
  Eigen::Index count_ = 0;
};

}  // namespace fastcal
