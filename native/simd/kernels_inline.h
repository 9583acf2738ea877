// SPDX-License-Identifier: MIT
// RISORIUS_INLINE: a function of the file's target, always inlined. After RISORIUS_TARGET.
#pragma once

#include <bit>
#include <cstdint>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_INLINE RISORIUS_TARGET __forceinline
#else
#define RISORIUS_INLINE RISORIUS_TARGET __attribute__((always_inline)) inline
#endif

namespace risorius::simd {

namespace {

RISORIUS_INLINE void place_bits(const float* from, std::uint32_t mask, float* to) {
  for (; mask != 0; mask &= mask - 1) to[std::countr_zero(mask)] = *from++;
}

}  // namespace

}  // namespace risorius::simd
