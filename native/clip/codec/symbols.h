// SPDX-License-Identifier: MIT
// The alphabet of a block's codes. A curve is a sequence of tokens: a symbol, which a prefix code
// stores, and extra bits, which are stored as they are.
#pragma once

#include <bit>
#include <cstdint>

#include "clip/codec/huffman.h"
#include "clip/codec/predict.h"

namespace risorius::clip {

// Symbol 0: the value equals the prediction. Symbols 2 b - 1 and 2 b: the magnitude of the
// prediction error has b bits; its sign equals the sign of the last error other than 0 (2 b - 1) or
// is opposite to it (2 b). The b - 1 bits below the highest bit are stored as extra bits.
// Symbol kRest + k: the last value is repeated 2^k to 2^(k + 1) - 1 times; the k bits below the
// highest bit of that count are stored as extra bits.
inline constexpr std::uint32_t kRest = 65;
inline constexpr std::uint32_t kRests = 13;  // up to kMostBlockFrames
static_assert(kRest + kRests <= kMostSymbols);

/// A block has up to this many prefix codes. The previous symbol chooses the code: code 0 at the
/// start and after a repetition; after a value, the first code i > 0 for which bounds[i - 1] is at
/// least the value's symbol, or the last code if there is none.
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
  std::uint32_t extra;  // only the lowest extra_bits(symbol) bits count
};

/// The token of a value.
/// In:     error  the value minus the prediction, both as in_order maps them
/// In/out: sign   sign of the last error other than 0, as sign_of gives it: 0 or all ones
inline Token value_token(std::uint32_t error, std::uint32_t& sign) {
  if (error == 0) return {0, 0};
  const std::uint32_t own = sign_of(error), size = (error ^ own) - own;
  const std::uint32_t is_other = own != sign ? 1 : 0;
  sign = own;
  return {2 * static_cast<std::uint32_t>(std::bit_width(size)) - 1 + is_other, size};
}
/// The token of a repetition. In: count  number of repeated values, above 0
inline Token rest_token(std::uint32_t count) {
  return {kRest + static_cast<std::uint32_t>(std::bit_width(count)) - 1, count};
}

}  // namespace risorius::clip
