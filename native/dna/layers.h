// SPDX-License-Identifier: MIT
// The table of layers that the format knows, in the order in which a writer appends them.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

namespace risorius::dna::detail {

using LayerId = std::array<char, 4>;

struct KnownLayer {
  char id[5];
  std::uint32_t version;      // major << 16 | minor
  bool typed;                 // has a struct in Dna; the others are kept as bytes
  std::uint32_t empty_size;   // bytes of an empty layer, all zero, when it is kept as bytes
  std::uint16_t since_minor;  // first file version 2.<minor> that has it
};

inline constexpr KnownLayer kLayers[] = {
    {"desc", 0x10001, true, 0, 2},   {"defn", 0x10001, true, 0, 2},
    {"bhvr", 0x10001, true, 0, 2},   {"geom", 0x10001, true, 0, 2},
    {"mlbh", 0x10000, false, 24, 3}, {"rbfb", 0x10000, false, 16, 4},
    {"rbfe", 0x10000, false, 8, 5},  {"jbmd", 0x10000, false, 4, 4},
    {"twsw", 0x10000, false, 8, 4},  {"mlbe", 0x10000, false, 20, 6},
    {"dsce", 0x10000, true, 0, 7},
};

inline const KnownLayer* find_layer(const LayerId& id) {
  for (const KnownLayer& layer : kLayers) {
    if (std::memcmp(layer.id, id.data(), 4) == 0) return &layer;
  }
  return nullptr;
}

/// A layer is known by the exact pair of id and version.
inline bool is_known(const LayerId& id, std::uint32_t version) {
  const KnownLayer* layer = find_layer(id);
  return layer != nullptr && layer->version == version;
}

inline bool is_typed(const LayerId& id) {
  const KnownLayer* layer = find_layer(id);
  return layer != nullptr && layer->typed;
}

}  // namespace risorius::dna::detail
