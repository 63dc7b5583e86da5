// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/aligned_numbers.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <new>

namespace fastcal {
namespace {

constexpr std::align_val_t kLine{64};
constexpr std::size_t kKept = std::size_t{1} << 17;  // numbers of a thread: a megabyte
constexpr std::size_t kLargest = 17;                 // of 2^17 numbers

/// Arrays of 2^k numbers that nobody uses, by k, linked through their first bytes.
class Spare {
 public:
  Spare() = default;
  Spare(const Spare&) = delete;
  Spare& operator=(const Spare&) = delete;
  ~Spare() {
    for (Link* link : first_) {
      while (link != nullptr) ::operator delete(std::exchange(link, link->next), kLine);
    }
  }

  double* take(std::size_t k) {
    Link*& link = first_.at(k);
    if (link == nullptr) return nullptr;
    count_ -= std::size_t{1} << k;
    return reinterpret_cast<double*>(std::exchange(link, link->next));
  }

  bool keep(double* numbers, std::size_t k) {
    const std::size_t count = std::size_t{1} << k;
    if (k > kLargest || count_ + count > kKept) return false;
    first_.at(k) = ::new (numbers) Link{first_.at(k)};
    count_ += count;
    return true;
  }

 private:
  struct Link {
    Link* next;
  };
  std::array<Link*, kLargest + 1> first_{};
  std::size_t count_ = 0;
};

Spare& spare() {
  thread_local Spare here;
  return here;
}

std::size_t power_of(Eigen::Index count) { return std::bit_width(static_cast<std::size_t>(count) - 1); }

}  // namespace

void AlignedNumbers::take(Eigen::Index count) {
  const std::size_t k = power_of(count < 8 ? 8 : count);
  if (k <= kLargest) {
    numbers_ = spare().take(k);
    count_ = Eigen::Index{1} << k;
  } else {
    count_ = (count + 7) / 8 * 8;
  }
  if (numbers_ == nullptr)
    numbers_ = static_cast<double*>(::operator new(static_cast<std::size_t>(count_) * sizeof(double), kLine));
}

void AlignedNumbers::give_back() {
  if (numbers_ == nullptr) return;
  const std::size_t k = power_of(count_);
  if (k > kLargest || !spare().keep(numbers_, k)) ::operator delete(numbers_, kLine);
  numbers_ = nullptr;
  count_ = 0;
}

}  // namespace fastcal
