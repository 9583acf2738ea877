// SPDX-License-Identifier: MIT
// Whether numbers are finite: no infinity and no NaN.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

namespace risorius::core {

/// Bit 31 of the result is set when the float of these bits is infinite or NaN, whose exponents are
/// all ones; the other bits mean nothing. A loop can collect the results of many floats with |, and
/// without a branch the compiler makes vectors of it.
inline std::uint32_t non_finite_bit(std::uint32_t bits) {
  return (bits & 0x7FFFFFFFu) + 0x00800000u;
}

inline bool is_finite(float value) {
  return non_finite_bit(std::bit_cast<std::uint32_t>(value)) >> 31 == 0;
}

/// Cost: one pass over the values, without an early end.
inline bool all_finite(std::span<const float> values) {
  std::uint32_t found = 0;
  for (const float value : values) found |= non_finite_bit(std::bit_cast<std::uint32_t>(value));
  return found >> 31 == 0;
}

/// The same of doubles, whose values are few: times and points of lines.
inline bool all_finite(std::span<const double> values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

}  // namespace risorius::core
