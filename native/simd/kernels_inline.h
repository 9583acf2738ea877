// SPDX-License-Identifier: MIT
// Definitions that the kernels' files share. RISORIUS_INLINE: a function of the file's target,
// always inlined. Include it after RISORIUS_TARGET.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_INLINE RISORIUS_TARGET __forceinline
#else
#define RISORIUS_INLINE RISORIUS_TARGET __attribute__((always_inline)) inline
#endif

namespace risorius::simd {

/// Tables for byte shuffles that spread packed floats over the set bits of a mask of four bits: the
/// first float goes to the lowest set bit, the next one to the next set bit, other places get 0.
/// kExpandBytes[mask]: for each byte of the result the index of the byte to copy; 0x80 gives 0.
inline constexpr auto kExpandBytes = [] {
  std::array<std::array<std::uint8_t, 16>, 16> orders{};
  for (std::size_t mask = 0; mask < 16; ++mask) {
    std::uint8_t next = 0;
    for (std::size_t p = 0; p < 4; ++p) {
      const bool taken = ((mask >> p) & 1u) != 0;
      for (std::size_t b = 0; b < 4; ++b) {
        orders[mask][4 * p + b] = taken ? static_cast<std::uint8_t>(next + b) : std::uint8_t{0x80};
      }
      if (taken) next = static_cast<std::uint8_t>(next + 4);
    }
  }
  return orders;
}();

namespace {

RISORIUS_INLINE void place_bits(const float* from, std::uint32_t mask, float* to) {
  for (; mask != 0; mask &= mask - 1) to[std::countr_zero(mask)] = *from++;
}

}  // namespace

}  // namespace risorius::simd
