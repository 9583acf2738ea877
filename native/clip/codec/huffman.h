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
  std::array<std::uint8_t, kMostSymbols> lengths{};  // bits; 0 for a symbol that does not occur
  std::array<std::uint16_t, kMostSymbols> bits{};    // the first bit of the code is the lowest

  /// Gives the bits that belong to lengths. False when there are more codes than bits allow.
  bool assign();
};

/// The code that makes a text shortest in which symbol i occurs counts[i] times.
Code make_code(std::span<const std::uint32_t, kMostSymbols> counts);

/// Appends the lengths of all codes, half a byte each; behind a zero stands how many more zeros
/// follow.
void put_lengths(Bytes& out, std::span<const Code> codes);

/// Reads what put_lengths wrote.
/// Out: codes, all of them; false when the bytes are no codes
bool get_lengths(Cursor& in, std::span<Code> codes);

}  // namespace risorius::clip
