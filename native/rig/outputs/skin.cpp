// SPDX-License-Identifier: MIT
// Packs the weights of a mesh's vertices on bones for the skinning kernels, and deforms the
// vertices. The vertices are divided into blocks of 1,024. In a block, the vertices with the same
// number of influences, rounded up to a multiple of four, form a run, which is stored in groups of
// four vertices.
#include "rig/outputs/skin.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace risorius::rig {
namespace {

using core::ErrorCode;
using core::fail;
using core::Result;
using core::Status;

struct Lists {
  std::span<const std::uint32_t> offsets, bones;
  std::span<const float> weights;
};

std::string found(std::size_t n) { return ", found " + std::to_string(n); }

Status check_offsets(std::uint32_t vertex_count, const Lists& lists) {
  const auto& offsets = lists.offsets;
  if (offsets.size() != std::size_t{vertex_count} + 1) {
    return fail(ErrorCode::kInvalidLength, "offsets",
                std::to_string(std::size_t{vertex_count} + 1) +
                    " offsets were expected, one more than vertices" + found(offsets.size()));
  }
  if (lists.bones.size() != lists.weights.size()) {
    return fail(ErrorCode::kInvalidLength, "weights",
                "a weight for each of " + std::to_string(lists.bones.size()) +
                    " bones was expected" + found(lists.weights.size()));
  }
  if (offsets.front() != 0 || !std::ranges::is_sorted(offsets) ||
      offsets.back() != lists.bones.size()) {
    return fail(ErrorCode::kInvalidIndex, "offsets",
                "offsets that ascend from 0 to the number of influences, " +
                    std::to_string(lists.bones.size()) + ", were expected");
  }
  return core::ok();
}

Status check_influences(const Lists& lists, std::uint32_t vertex_count, std::uint32_t bone_count) {
  for (std::size_t v = 0; v < vertex_count; ++v) {
    for (std::size_t i = lists.offsets[v]; i < lists.offsets[v + 1]; ++i) {
      if (lists.bones[i] >= bone_count) {
        return fail(ErrorCode::kInvalidIndex, "bones",
                    "vertex " + std::to_string(v) + " has a weight of bone " +
                        std::to_string(lists.bones[i]) + ", but there are " +
                        std::to_string(bone_count));
      }
      if (!(lists.weights[i] >= 0) || !std::isfinite(lists.weights[i])) {
        return fail(ErrorCode::kInvalidValue, "weights",
                    "vertex " + std::to_string(v) + " has the weight " +
                        std::to_string(lists.weights[i]) + " of bone " +
                        std::to_string(lists.bones[i]) + "; 0 or more was expected");
      }
    }
  }
  return core::ok();
}

// The sum of a vertex's weights, by which they are divided; 0 if the vertex does not move because
// the sum is too small or infinite.
float divisor(std::span<const float> weights) {
  const float sum = std::accumulate(weights.begin(), weights.end(), 0.0f);
  return sum > kLeastWeight && std::isfinite(sum) ? sum : 0.0f;
}

// A vertex's number of influences other than 0, in groups of four, rounded up; 0 if the vertex does
// not move.
std::uint32_t fours_of(std::span<const float> weights) {
  if (divisor(weights) == 0) return 0;
  const auto none = static_cast<std::size_t>(std::ranges::count(weights, 0.0f));
  return static_cast<std::uint32_t>((weights.size() - none + 3) / 4);
}

std::span<const float> weights_of(const Lists& lists, std::size_t v) {
  return lists.weights.subspan(lists.offsets[v], lists.offsets[v + 1] - lists.offsets[v]);
}

// Writes a vertex's influences into its group of vertices.
// In: at     index of the first influence of the group
//     place  number of the vertex in the group
void put_vertex(const Lists& lists, std::size_t v, std::size_t at, std::size_t place, Skin& skin) {
  const std::span<const float> weights = weights_of(lists, v);
  const float sum = divisor(weights);
  std::size_t n = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    const std::size_t to = at + (n / 4 * simd::kSkinGroup + place) * 4 + n % 4;
    skin.bones[to] = static_cast<std::uint16_t>(lists.bones[lists.offsets[v] + i]);
    skin.weights[to] = weights[i] / sum;
    ++n;
  }
}

// Adds a run: vertices of a block with the same number of influences, rounded up to fours.
// In: begin     first vertex of the block
//     vertices  the vertices of the run, relative to begin
//     fours     number of groups of four influences of each vertex
void add_run(const Lists& lists, std::size_t begin, std::span<const std::uint16_t> vertices,
             std::uint32_t fours, Skin& skin) {
  skin.runs.push_back({static_cast<std::uint32_t>(vertices.size()), fours});
  skin.vertices.insert(skin.vertices.end(), vertices.begin(), vertices.end());
  for (std::size_t v = 0; fours > 0 && v < vertices.size(); ++v) {
    const std::size_t size = std::size_t{fours} * 4 * simd::kSkinGroup;
    if (v % simd::kSkinGroup == 0) {
      skin.bones.resize(skin.bones.size() + size, static_cast<std::uint16_t>(skin.bone_count));
      skin.weights.resize(skin.weights.size() + size);
    }
    put_vertex(lists, begin + vertices[v], skin.bones.size() - size, v % simd::kSkinGroup, skin);
  }
}

// Adds a block with the vertices [begin, end), sorted by number of influences, rounded up to fours,
// and then by index.
void add_block(const Lists& lists, std::uint32_t begin, std::uint32_t end, Skin& skin) {
  std::vector<std::uint32_t> fours;
  for (std::uint32_t v = begin; v < end; ++v) fours.push_back(fours_of(weights_of(lists, v)));
  std::vector<std::uint16_t> order(end - begin);
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  const auto key = [&fours](std::uint16_t v) { return fours[v]; };
  std::ranges::stable_sort(order, {}, key);
  skin.blocks.push_back({static_cast<std::uint32_t>(skin.runs.size()), skin.bones.size()});
  for (auto at = order.begin(); at != order.end();) {
    const auto next = std::ranges::upper_bound(at, order.end(), key(*at), {}, key);
    add_run(lists, begin, {at, next}, key(*at), skin);
    at = next;
  }
}

}  // namespace

std::size_t Skin::memory_bytes() const {
  return sizeof(Skin) + runs.size() * sizeof(simd::SkinRun) + blocks.size() * sizeof(Block) +
         (vertices.size() + bones.size() + bones_used.size()) * 2 + weights.size() * 4;
}

Result<Skin> make_skin(std::uint32_t vertex_count, std::span<const std::uint32_t> offsets,
                       std::span<const std::uint32_t> bones, std::span<const float> weights,
                       std::uint32_t bone_count) {
  const Lists lists{offsets, bones, weights};
  if (bone_count > 0xFFFF) {
    return fail(ErrorCode::kLimitExceeded, "bone_count",
                "at most 65535 bones were expected" + found(bone_count));
  }
  RISORIUS_TRY(check_offsets(vertex_count, lists));
  RISORIUS_TRY(check_influences(lists, vertex_count, bone_count));
  Skin skin;
  skin.vertex_count = vertex_count, skin.bone_count = bone_count;
  skin.vertices.reserve(vertex_count);
  skin.bones.reserve(bones.size());
  skin.weights.reserve(bones.size());
  for (std::uint32_t v = 0; v < vertex_count; v += std::min(kSkinBlock, vertex_count - v)) {
    add_block(lists, v, v + std::min(kSkinBlock, vertex_count - v), skin);
  }
  skin.blocks.push_back({static_cast<std::uint32_t>(skin.runs.size()), skin.bones.size()});
  skin.bones.shrink_to_fit();
  skin.weights.shrink_to_fit();
  std::vector<std::uint8_t> used(std::size_t{bone_count} + 1);
  // Missing influences have the bone bone_count, which the loop over bones leaves out.
  for (const std::uint16_t bone : skin.bones) used[bone] = 1;
  for (std::uint32_t b = 0; b < bone_count; ++b) {
    if (used[b] != 0) skin.bones_used.push_back(static_cast<std::uint16_t>(b));
  }
  return skin;
}

void evaluate_skin_block(const Skin& skin, const simd::Kernels& kernels, const float* rows,
                         std::uint32_t block, const float* points, float* out) noexcept {
  const Skin::Block &own = skin.blocks[block], &next = skin.blocks[block + 1];
  kernels.skin(rows,
               {skin.runs.data() + own.run, next.run - own.run,
                skin.vertices.data() + std::size_t{block} * kSkinBlock,
                skin.bones.data() + own.influence, skin.weights.data() + own.influence},
               points, out);
}

void evaluate_skin(const Skin& skin, const simd::Kernels& kernels, const float* rows,
                   const float* points, float* out) noexcept {
  for (std::uint32_t b = 0; b < skin.block_count(); ++b) {
    const std::size_t begin = std::size_t{b} * kSkinBlock * 3;
    evaluate_skin_block(skin, kernels, rows, b, points + begin, out + begin);
  }
}

}  // namespace risorius::rig
