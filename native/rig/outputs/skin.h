// SPDX-License-Identifier: MIT
// Skin: how much each bone holds of each vertex of a mesh, and the vertices that follow from it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/aligned.h"
#include "core/result.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// Vertices of one block: so many are read, summed and written while the first cache holds them.
inline constexpr std::uint32_t kSkinBlock = 1024;
/// A vertex whose weights add up to no more than this stays where it is.
inline constexpr float kLeastWeight = 1e-4f;

struct Skin {
  struct Block {
    std::uint32_t run = 0;  // the first of its runs
    std::size_t influence = 0;
  };
  std::uint32_t vertex_count = 0, bone_count = 0;
  std::vector<simd::SkinRun> runs;        // of each block, by ascending fours
  std::vector<Block> blocks;              // one more than there are
  std::vector<std::uint16_t> vertices;    // from the begin of the block, in the order of the runs
  std::vector<std::uint16_t> bones;       // as simd::SkinPart has them; none is bone_count
  core::AlignedVector<float> weights;     // the same, each divided by the sum of its vertex
  std::vector<std::uint16_t> bones_used;  // ascending

  std::uint32_t block_count() const { return static_cast<std::uint32_t>(blocks.size() - 1); }
  std::size_t memory_bytes() const;
};

/// In:    offsets  uint32[vertices + 1]: where the influences of each vertex begin
///        bones    [influences], below bone_count; weights [influences], 0 or more, which need not
///                 add up to 1. A weight of 0 is none
///        bone_count  at most 65,535
/// Fails: invalid_index, invalid_length or invalid_value with the vertex and its influence
core::Result<Skin> make_skin(std::uint32_t vertex_count, std::span<const std::uint32_t> offsets,
                             std::span<const std::uint32_t> bones, std::span<const float> weights,
                             std::uint32_t bone_count);

/// One block of a mesh: out = p + (sum of weight * (M p - p)) / sum of weights.
/// In:  rows    float32[bone_count + 1, kSkinRow] on a cache line: of kernels.skin_rows for
/// matrices
///              of evaluate_chain, where what is not finite spoils the vertices that its bone has a
///              weight of, and a last row of 0
///      block   below block_count
///      points  float32[kSkinBlock, 3], or fewer for the last block
/// Out: out     float32[kSkinBlock, 3]; may be points
void evaluate_skin_block(const Skin& skin, const simd::Kernels& kernels, const float* rows,
                         std::uint32_t block, const float* points, float* out) noexcept;
/// All blocks of a mesh. In: points, out  float32[vertices, 3]
void evaluate_skin(const Skin& skin, const simd::Kernels& kernels, const float* rows,
                   const float* points, float* out) noexcept;

}  // namespace risorius::rig
