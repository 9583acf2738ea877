// SPDX-License-Identifier: MIT
// Converts big-endian numbers of a file to the machine's byte order, once for each instruction set.
// Plain loops, which the compiler vectorises under RISORIUS_TARGET.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/finite.h"
#include "simd/kernels_inline.h"

namespace risorius::simd {

namespace {

RISORIUS_INLINE std::uint16_t from_big_endian(std::uint16_t v) {
  if constexpr (std::endian::native == std::endian::big) return v;
  return static_cast<std::uint16_t>((v >> 8) | (v << 8));
}
RISORIUS_INLINE std::uint32_t from_big_endian(std::uint32_t v) {
  if constexpr (std::endian::native == std::endian::big) return v;
  return (v >> 24) | ((v >> 8) & 0xFF00u) | ((v << 8) & 0xFF0000u) | (v << 24);
}

// Copies a big-endian number to `to` in the machine's byte order, and returns it.
template <class Word>
RISORIUS_INLINE Word copy_number(const std::uint8_t* from, void* to) {
  Word v;
  std::memcpy(&v, from, sizeof(Word));
  v = from_big_endian(v);
  std::memcpy(to, &v, sizeof(Word));
  return v;
}

RISORIUS_TARGET void native_u16(const std::uint8_t* from, std::uint16_t* to, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) copy_number<std::uint16_t>(from + 2 * i, to + i);
}
RISORIUS_TARGET std::uint32_t native_u32(const std::uint8_t* from, std::uint32_t* to,
                                         std::size_t n) {
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto v = copy_number<std::uint32_t>(from + 4 * i, to + i);
    largest = v > largest ? v : largest;
  }
  return largest;
}
RISORIUS_TARGET bool native_f32(const std::uint8_t* from, float* to, std::size_t n) {
  std::uint32_t found = 0;
  for (std::size_t i = 0; i < n; ++i) {
    found |= core::non_finite_bit(copy_number<std::uint32_t>(from + 4 * i, to + i));
  }
  return found >> 31 == 0;
}

}  // namespace

}  // namespace risorius::simd
