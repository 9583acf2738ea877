// SPDX-License-Identifier: MIT
// For vectors of four places whose bytes a table orders.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace risorius::simd {

/// For each mask of four places the bytes that each takes; of none, 0.
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

}  // namespace risorius::simd
