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

/// Cost: one pass over all values.
inline bool all_finite(std::span<const float> values) {
  std::uint32_t found = 0;
  for (const float value : values) found |= non_finite_bit(std::bit_cast<std::uint32_t>(value));
  return found >> 31 == 0;
}

/// Like all_finite for floats, but without vectorised code, because lists of doubles are short:
/// times and points of polylines.
inline bool all_finite(std::span<const double> values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

}  // namespace risorius::core
