// SPDX-License-Identifier: MIT
// Tests for finite numbers: neither infinity nor NaN.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

namespace risorius::core {

/// Bit 31 of the result is set if the float with these bits is infinite or NaN (its exponent bits
/// are all 1); the other bits are undefined. A loop can combine the results of many floats with |,
/// and the compiler vectorises it because it has no branch.
inline std::uint32_t non_finite_bit(std::uint32_t bits) {
  return (bits & 0x7FFFFFFFu) + 0x00800000u;
}

inline bool is_finite(float value) {
  return non_finite_bit(std::bit_cast<std::uint32_t>(value)) >> 31 == 0;
}

/// Whether no value is infinite or NaN. Reads all values, without a branch for each.
inline bool all_finite(std::span<const float> values) {
  std::uint32_t found = 0;
  for (const float value : values) found |= non_finite_bit(std::bit_cast<std::uint32_t>(value));
  return found >> 31 == 0;
}

/// The same for doubles. It ends at the first such value and is not vectorised, because lists of
/// doubles (times and points of polylines) are short.
inline bool all_finite(std::span<const double> values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

}  // namespace risorius::core
