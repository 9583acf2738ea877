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

/// For each mask of four places: the bytes of the values that each place gets, 0x80 (which gives 0)
/// for a place without a value. For instruction sets that shuffle bytes by a table.
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
