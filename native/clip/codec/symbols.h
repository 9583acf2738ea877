// SPDX-License-Identifier: MIT
// The alphabet of the codes of a block. A curve is a sequence of tokens: a symbol, which a prefix
// code stores, and extra bits, which are stored as they are.
#pragma once

#include <bit>
#include <cstdint>

#include "clip/codec/huffman.h"
#include "clip/codec/predict.h"

namespace risorius::clip {

// Symbol 0: the value is the predicted one. Symbols 2 b - 1 and 2 b: the error of the prediction
// has b bits; its sign is that of the last error other than 0 (2 b - 1) or the opposite one (2 b).
// The b - 1 bits below its highest one are the extra bits.
// Symbol kRest + k: the last value is repeated 2^k to 2^(k + 1) - 1 times; the k bits below the
// highest bit of that count are the extra bits.
inline constexpr std::uint32_t kRest = 65;
inline constexpr std::uint32_t kRests = 13;  // up to kMostBlockFrames
static_assert(kRest + kRests <= kMostSymbols);

/// A block has several prefix codes, and the symbol before decides which one stores a symbol: code
/// 0 behind a repetition, behind a value the first code i > 0 whose bounds[i] the symbol does not
/// exceed.
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

/// The token of a value.
/// In:  error  the value minus the prediction
///      sign   of the last error that was not 0: 0 or all ones
/// Out: sign   becomes that of this error, unless it is 0
inline Token value_token(std::uint32_t error, std::uint32_t& sign) {
  if (error == 0) return {0, 0};
  const std::uint32_t own = sign_of(error), size = (error ^ own) - own;
  const std::uint32_t is_other = own != sign ? 1 : 0;
  sign = own;
  return {2 * static_cast<std::uint32_t>(std::bit_width(size)) - 1 + is_other, size};
}
/// The token of a repetition. In: count above 0.
inline Token rest_token(std::uint32_t count) {
  return {kRest + static_cast<std::uint32_t>(std::bit_width(count)) - 1, count};
}

}  // namespace risorius::clip
