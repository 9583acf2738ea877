// SPDX-License-Identifier: MIT
// Adds the weighted displacements (deltas) of a mesh's blend shape targets to its base vertices.
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
    const std::uint32_t begin = morph.channel_offsets[c];
    add_deltas(morph.deltas.data() + begin, morph.channel_offsets[c + 1] - begin, w, 0, out);
  }
}

void add_deltas(const Morph::Delta* deltas, std::size_t n, float weight, std::uint32_t first,
                float* values) noexcept {
  for (const Morph::Delta* d = deltas; d < deltas + n; ++d) {
    float* v = values + std::size_t{d->vertex - first} * 3;
    v[0] += weight * d->x;
    v[1] += weight * d->y;
    v[2] += weight * d->z;
  }
}

}  // namespace risorius::rig
