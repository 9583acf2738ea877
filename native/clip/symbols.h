// SPDX-License-Identifier: MIT
// The alphabet of a block's codes. A symbol is followed by bits of its own.
#pragma once

#include <bit>
#include <cstdint>

#include "clip/huffman.h"

namespace risorius::clip {

// 0 to 32: a value whose folded error has so many bits; all below the first one follow.
// kRest + k: the last value 2^k to 2^(k+1) - 1 times more; k bits follow.
inline constexpr std::uint32_t kRest = 33;
inline constexpr std::uint32_t kRests = 13;  // up to kMostBlockFrames
static_assert(kRest + kRests <= kMostSymbols);

/// Which code is next depends on the symbol before. Code 0 follows a rest; the others a value whose
/// symbol is at most bounds[i], each.
inline constexpr std::size_t kMostCodes = 9;

constexpr std::uint32_t extra_bits(std::uint32_t symbol) {
  if (symbol >= kRest) return symbol - kRest;
  return symbol > 0 ? symbol - 1 : 0;
}

struct Token {
  std::uint32_t symbol;
  std::uint32_t extra;  // the lowest extra_bits(symbol) bits count
};

inline Token value_token(std::uint32_t folded) {
  return {static_cast<std::uint32_t>(std::bit_width(folded)), folded};
}
inline Token rest_token(std::uint32_t count) {
  return {kRest + static_cast<std::uint32_t>(std::bit_width(count)) - 1, count};
}

}  // namespace risorius::clip
