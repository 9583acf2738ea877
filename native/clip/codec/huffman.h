// SPDX-License-Identifier: MIT
// Prefix codes of at most kLongestCode bits for a small alphabet.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "clip/codec/little_endian.h"

namespace risorius::clip {

inline constexpr int kLongestCode = 10;
inline constexpr std::size_t kMostSymbols = 78;

struct Code {
  std::array<std::uint8_t, kMostSymbols> lengths{};  // bits; 0: the symbol does not occur
  std::array<std::uint16_t, kMostSymbols> bits{};    // the first bit of a code is the lowest

  /// Assigns bits by the lengths. False if there are more codes than the lengths allow.
  bool assign();
};

/// The code that makes a text with counts[i] symbols i shortest.
Code make_code(std::span<const std::uint32_t, kMostSymbols> counts);

/// Appends the lengths of all codes, half a byte each. Behind a zero stands the number of further
/// zeros.
void put_lengths(Bytes& out, std::span<const Code> codes);

/// Reads the result of put_lengths.
/// Out: all codes; false if the bytes are not valid codes
bool get_lengths(Cursor& in, std::span<Code> codes);

}  // namespace risorius::clip
