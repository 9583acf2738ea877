// SPDX-License-Identifier: MIT
// Converts between float32 and IEEE 754 half floats (16 bits) in plain code.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace risorius::simd {

inline constexpr float kLargestHalf = 65504.0f;

/// Converts a half float exactly. In: half  finite
inline float from_half(std::uint16_t half) {
  // The exponent biases differ by 112: multiplying by 2^112 corrects that, for denormals too.
  const float magnitude = std::bit_cast<float>((half & 0x7FFFu) << 13) * 0x1p112f;
  const std::uint32_t sign = (half & 0x8000u) << 16;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) | sign);
}

/// Rounds to the nearest half float, ties to even. In: |value| <= kLargestHalf.
inline std::uint16_t to_half(float value) {
  const std::uint32_t sign = (std::bit_cast<std::uint32_t>(value) >> 16) & 0x8000u;
  const float magnitude = std::fabs(value);
  std::uint32_t bits;
  if (magnitude < 0x1p-14f) {  // a denormal half counts steps of 2^-24
    bits = static_cast<std::uint32_t>(std::nearbyint(magnitude * 0x1p24f));
  } else {
    const std::uint32_t wide = std::bit_cast<std::uint32_t>(magnitude) - (112u << 23);
    bits = (wide + 0x0FFFu + ((wide >> 13) & 1u)) >> 13;
  }
  return static_cast<std::uint16_t>(sign | bits);
}

}  // namespace risorius::simd
