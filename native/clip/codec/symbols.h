// SPDX-License-Identifier: MIT
// The alphabet of a block's codes. A symbol is followed by bits of its own.
#pragma once

#include <bit>
#include <cstdint>

#include "clip/codec/huffman.h"
#include "clip/codec/predict.h"

namespace risorius::clip {

// 0: a value as it was predicted. 2 b - 1 and 2 b: the error has b bits, and the sign of the error
// before, or not; all its bits below the first one follow.
// kRest + k: the last value 2^k to 2^(k+1) - 1 times more; k bits follow.
inline constexpr std::uint32_t kRest = 65;
inline constexpr std::uint32_t kRests = 13;  // up to kMostBlockFrames
static_assert(kRest + kRests <= kMostSymbols);

/// Which code is next depends on the symbol before. Code 0 follows a rest; the others a value whose
/// symbol is at most bounds[i], each.
inline constexpr std::size_t kMostCodes = 9;

constexpr std::uint32_t extra_bits(std::uint32_t symbol) {
  if (symbol >= kRest) return symbol - kRest;
  return symbol > 0 ? (symbol - 1) / 2 : 0;
}
constexpr bool has_other_sign(std::uint32_t symbol) {
  return symbol > 0 && symbol < kRest && symbol % 2 == 0;
}

struct Token {
  std::uint32_t symbol;
  std::uint32_t extra;  // the lowest extra_bits(symbol) bits count
};

/// In: sign, 0 or all ones, of the last error that was not 0; Out: also of this one.
inline Token value_token(std::uint32_t error, std::uint32_t& sign) {
  if (error == 0) return {0, 0};
  const std::uint32_t own = sign_of(error), size = (error ^ own) - own;
  const std::uint32_t is_other = own != sign ? 1 : 0;
  sign = own;
  return {2 * static_cast<std::uint32_t>(std::bit_width(size)) - 1 + is_other, size};
}
inline Token rest_token(std::uint32_t count) {
  return {kRest + static_cast<std::uint32_t>(std::bit_width(count)) - 1, count};
}

}  // namespace risorius::clip
