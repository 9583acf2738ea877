// SPDX-License-Identifier: MIT
// Skin: the weights of a mesh's vertices on bones, and the deformation of the vertices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/aligned.h"
#include "core/result.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// Number of vertices in a block: so few that the first-level cache has room for them while they
/// are read, summed and written.
inline constexpr std::uint32_t kSkinBlock = 1024;
/// A vertex does not move if the sum of its weights is at most this, or infinite.
inline constexpr float kLeastWeight = 1e-4f;

struct Skin {
  struct Block {
    std::uint32_t run = 0;      // the first of its runs
    std::size_t influence = 0;  // its first influence, an index into bones and weights
  };
  std::uint32_t vertex_count = 0, bone_count = 0;
  // The runs of one block after the other, in a block by ascending number of influences.
  std::vector<simd::SkinRun> runs;
  std::vector<Block> blocks;  // one for each block, and one behind the last
  // The vertices of each run, relative to the first vertex of their block.
  std::vector<std::uint16_t> vertices;
  std::vector<std::uint16_t> bones;    // as in simd::SkinPart; bone_count stands for no bone
  core::AlignedVector<float> weights;  // the same, each divided by the sum of its vertex's weights
  std::vector<std::uint16_t> bones_used;  // the bones that move a vertex, ascending

  std::uint32_t block_count() const { return static_cast<std::uint32_t>(blocks.size() - 1); }
  std::size_t memory_bytes() const;
};

/// Checks the weights of a mesh and packs them for the kernels.
/// In:    offsets     uint32[vertices + 1]: the first influence of each vertex
///        bones       [influences], below bone_count
///        weights     [influences], 0 or more; they need not add up to 1, and 0 counts as no
///                    influence
///        bone_count  at most 65,535
/// Fails: kInvalidIndex, kInvalidLength or kInvalidValue with the vertex and its influence;
///        kLimitExceeded (bone_count)
core::Result<Skin> make_skin(std::uint32_t vertex_count, std::span<const std::uint32_t> offsets,
                             std::span<const std::uint32_t> bones, std::span<const float> weights,
                             std::uint32_t bone_count);

/// Deforms one block of a mesh: out = p + (sum of weight * (M p - p)) / sum of weights.
/// In:  rows    float32[bone_count + 1, kSkinRow], aligned to a cache line: kernels.skin_rows of
///              the matrices of evaluate_chain, and a last row of 0. A matrix that is not finite
///              makes the vertices with a weight on its bone invalid
///      block   below block_count
///      points  float32[kSkinBlock, 3], the vertices of the block; the last block has fewer
/// Out: out     like points; may be the same array
void evaluate_skin_block(const Skin& skin, const simd::Kernels& kernels, const float* rows,
                         std::uint32_t block, const float* points, float* out) noexcept;
/// Deforms all blocks of a mesh. In: points, out  float32[vertices, 3]
void evaluate_skin(const Skin& skin, const simd::Kernels& kernels, const float* rows,
                   const float* points, float* out) noexcept;

}  // namespace risorius::rig
