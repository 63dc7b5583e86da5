// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Bad input is met at the door: FASTCAL_CHECK(condition) << "what was expected, what came, where";
// throws InvalidInput. Numerical outcomes (not converged, not identifiable) are values, never exceptions.
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace fastcal {

/// An argument that cannot be meant as it is; the message is one sentence for the person who gave it.
class InvalidInput : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

namespace internal {

/// Collects a message and throws it as InvalidInput at the end of the statement.
class CheckFailure {
 public:
  CheckFailure() = default;
  CheckFailure(const CheckFailure&) = delete;
  CheckFailure& operator=(const CheckFailure&) = delete;
  [[noreturn]] ~CheckFailure() noexcept(false) { throw InvalidInput(message_.str()); }

  template <typename T>
  CheckFailure& operator<<(const T& value) {
    message_ << value;
    return *this;
  }

 private:
  std::ostringstream message_;
};

}  // namespace internal
}  // namespace fastcal

#define FASTCAL_CHECK(condition) \
  if (condition) {               \
  } else                         \
    ::fastcal::internal::CheckFailure()
