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

  /// Assigns the bits of each code from its length. False if there are more codes than the lengths
  /// allow.
  bool assign();
};

/// The Huffman code for a text in which symbol i occurs counts[i] times. If it has a code longer
/// than kLongestCode bits, a code within this limit, which needs slightly more bits.
Code make_code(std::span<const std::uint32_t, kMostSymbols> counts);

/// Appends the code lengths of all symbols of all codes, half a byte each. After a length of 0
/// follows the number of further zeros, at most 15.
void put_lengths(Bytes& out, std::span<const Code> codes);

/// Reads the result of put_lengths. Fills all codes.
/// Out: false if the bytes are not valid codes
bool get_lengths(Cursor& in, std::span<Code> codes);

}  // namespace risorius::clip
