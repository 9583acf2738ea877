// SPDX-License-Identifier: MIT
// Compiles the blend shape targets of one mesh to a Morph: for each channel, the displacements
// (deltas) of all its targets, sorted by vertex.
#include <algorithm>
#include <span>

#include "compile/compile.h"

namespace risorius::compile {

namespace {

using core::ErrorCode;
using core::fail;
using core::Result;

rig::Morph::Delta transformed(const dna::BlendShapeTarget& t, std::size_t i,
                              const std::array<float, 9>& m) {
  const float x = t.deltas.at(i, 0), y = t.deltas.at(i, 1), z = t.deltas.at(i, 2);
  return {t.vertex_indices[i], m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z,
          m[6] * x + m[7] * y + m[8] * z};
}

// Sorts the deltas of each channel by vertex, so that a range of vertices is one run. Deltas of one
// vertex stay in order, so that their sum does not change.
void sort_deltas(rig::Morph& morph) {
  for (std::size_t c = 0; c + 1 < morph.channel_offsets.size(); ++c) {
    const auto run = std::span(morph.deltas)
                         .subspan(morph.channel_offsets[c],
                                  morph.channel_offsets[c + 1] - morph.channel_offsets[c]);
    if (!std::ranges::is_sorted(run, {}, &rig::Morph::Delta::vertex)) {
      std::ranges::stable_sort(run, {}, &rig::Morph::Delta::vertex);
    }
  }
}

}  // namespace

Result<rig::Morph> compile_morph(const dna::Dna& dna, std::size_t mesh_index,
                                 const std::array<float, 9>& matrix) {
  if (mesh_index >= dna.geometry.meshes.size()) {
    return fail(ErrorCode::kInvalidIndex, "mesh_index",
                "mesh " + std::to_string(mesh_index) + ", but there are " +
                    std::to_string(dna.geometry.meshes.size()));
  }
  const dna::Mesh& mesh = dna.geometry.meshes[mesh_index];
  rig::Morph out;
  out.vertex_count = static_cast<std::uint32_t>(mesh.positions.count());
  out.channel_count = static_cast<std::uint32_t>(dna.definition.blend_shape_channel_names.size());
  std::vector<const dna::BlendShapeTarget*> targets;
  for (const dna::BlendShapeTarget& t : mesh.blend_shape_targets) targets.push_back(&t);
  std::ranges::stable_sort(targets, {}, &dna::BlendShapeTarget::blend_shape_channel_index);
  for (const dna::BlendShapeTarget* t : targets) {
    const std::string where = "geometry.meshes[" + std::to_string(mesh_index) + "]";
    if (t->blend_shape_channel_index >= out.channel_count ||
        t->deltas.count() != t->vertex_indices.size() ||
        std::ranges::any_of(t->vertex_indices.span(),
                            [&](std::uint32_t v) { return v >= out.vertex_count; })) {
      return fail(ErrorCode::kInvalidIndex, where + ".blend_shape_targets",
                  "a target names a channel or vertex that does not exist");
    }
    if (out.channels.empty() || out.channels.back() != t->blend_shape_channel_index) {
      out.channels.push_back(t->blend_shape_channel_index);
      out.channel_offsets.push_back(static_cast<std::uint32_t>(out.deltas.size()));
    }
    for (std::size_t i = 0; i < t->vertex_indices.size(); ++i) {
      out.deltas.push_back(transformed(*t, i, matrix));
    }
  }
  out.channel_offsets.push_back(static_cast<std::uint32_t>(out.deltas.size()));
  sort_deltas(out);
  return out;
}

}  // namespace risorius::compile
