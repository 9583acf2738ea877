// SPDX-License-Identifier: MIT
// The table of the format's layers, in the order in which a writer appends the layers that are not
// in the index of the source file.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

#include "dna/dna.h"

namespace risorius::dna::detail {

using LayerId = std::array<char, 4>;

struct KnownLayer {
  char id[5];
  std::uint32_t version;      // major << 16 | minor
  std::uint16_t since_minor;  // first file version 2.<minor> with the layer
};

inline constexpr KnownLayer kLayers[] = {
    {"desc", 0x10001, 2}, {"defn", 0x10001, 2}, {"bhvr", 0x10001, 2}, {"geom", 0x10001, 2},
    {"mlbh", 0x10000, 3}, {"rbfb", 0x10000, 4}, {"rbfe", 0x10000, 5}, {"jbmd", 0x10000, 4},
    {"twsw", 0x10000, 4}, {"mlbe", 0x10000, 6}, {"dsce", 0x10000, 7},
};

/// The table entry of a layer, which is known only by the exact pair of id and version.
/// In:  version  major << 16 | minor
/// Out: nullptr if the pair is unknown
inline const KnownLayer* find_layer(const LayerId& id, std::uint32_t version) {
  for (const KnownLayer& layer : kLayers) {
    if (std::memcmp(layer.id, id.data(), 4) == 0 && layer.version == version) return &layer;
  }
  return nullptr;
}

/// Calls f(id, field name, struct) for each layer that has a struct in Dna, in the order of the
/// table kLayers.
template <class D, class F>
void for_each_layer(D& dna, F f) {
  f("desc", "descriptor", dna.descriptor);
  f("defn", "definition", dna.definition);
  f("bhvr", "behavior", dna.behavior);
  f("geom", "geometry", dna.geometry);
  f("mlbh", "machine_learned_behavior", dna.machine_learned_behavior);
  f("rbfb", "rbf_behavior", dna.rbf_behavior);
  f("rbfe", "rbf_behavior_ext", dna.rbf_behavior_ext);
  f("jbmd", "joint_behavior_metadata", dna.joint_behavior_metadata);
  f("twsw", "twist_swing_behavior", dna.twist_swing_behavior);
  f("mlbe", "machine_learned_behavior_ext", dna.machine_learned_behavior_ext);
  f("dsce", "descriptor_ext", dna.descriptor_ext);
}

}  // namespace risorius::dna::detail
