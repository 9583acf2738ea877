// SPDX-License-Identifier: MIT
// Morph: the blend shape targets of one mesh, compiled for summing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace risorius::rig {

struct Morph {
  struct Delta {
    std::uint32_t vertex;
    float x, y, z;
  };
  std::uint32_t vertex_count = 0;
  std::uint32_t channel_count = 0;             // length of the weights
  std::vector<std::uint16_t> channels;         // channels with a target in this mesh, ascending
  std::vector<std::uint32_t> channel_offsets;  // [channels + 1] into deltas
  std::vector<Delta> deltas;                   // by channel, then by vertex

  std::size_t memory_bytes() const;
};

/// out = base + sum of weight * delta over the channels whose weight is not zero.
/// In:  weights float32[channel_count]; base float32[vertices, 3] or nullptr for zeros
/// Out: out     float32[vertices, 3], may not overlap base
void evaluate_morph(const Morph& morph, const float* weights, const float* base,
                    float* out) noexcept;

/// values[vertex - first] += weight * delta, for n deltas.
/// In: first   the vertex to which the first row of values, float32[.., 3], belongs
void add_deltas(const Morph::Delta* deltas, std::size_t n, float weight, std::uint32_t first,
                float* values) noexcept;

}  // namespace risorius::rig
