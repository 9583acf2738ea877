// SPDX-License-Identifier: MIT
#include "rig/outputs/morph.h"

#include <algorithm>

namespace risorius::rig {

std::size_t Morph::memory_bytes() const {
  return sizeof(Morph) + channels.size() * 2 + channel_offsets.size() * 4 +
         deltas.size() * sizeof(Delta);
}

void evaluate_morph(const Morph& morph, const float* weights, const float* base,
                    float* out) noexcept {
  const std::size_t n = std::size_t{morph.vertex_count} * 3;
  if (base != nullptr) {
    std::copy(base, base + n, out);
  } else {
    std::fill(out, out + n, 0.0f);
  }
  for (std::size_t c = 0; c < morph.channels.size(); ++c) {
    const float w = weights[morph.channels[c]];
    if (w == 0.0f) continue;
    for (std::uint32_t i = morph.channel_offsets[c]; i < morph.channel_offsets[c + 1]; ++i) {
      const Morph::Delta& d = morph.deltas[i];
      float* v = out + std::size_t{d.vertex} * 3;
      v[0] += w * d.x;
      v[1] += w * d.y;
      v[2] += w * d.z;
    }
  }
}

}  // namespace risorius::rig
