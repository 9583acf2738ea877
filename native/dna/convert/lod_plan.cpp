// SPDX-License-Identifier: MIT
// The plan: the kept LODs, and the joints, channels, maps, meshes and networks that they use.
#include <algorithm>
#include <optional>
#include <string>

#include "dna/convert/lods.h"

namespace risorius::dna::detail {

namespace {

using core::ErrorCode;
using core::fail;
using core::Result;

void mark(const LodPlan& plan, const LodMapping& mapping, std::vector<bool>& keep) {
  for (const std::uint16_t lod : plan.lods) {
    if (lod >= mapping.lods.size() || mapping.lods[lod] >= mapping.rows.size()) continue;
    for (const std::uint16_t i : mapping.rows[mapping.lods[lod]]) {
      if (i < keep.size()) keep[i] = true;
    }
  }
}

std::uint16_t first_root(const IndexMap& joints, const Definition& d) {
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (joints.keeps(j) && d.joint_parents[j] == j) return joints[j];
  }
  return 0;
}

std::vector<bool> kept_joints(const LodPlan& plan, const Definition& d) {
  std::vector<bool> keep = needed(plan, d.lod_joint_mapping, d.joint_names.size());
  LodPlan finest;
  finest.lods = {0};
  const std::vector<bool> listed = needed(finest, d.lod_joint_mapping, keep.size());
  for (std::size_t j = 0; j < keep.size(); ++j) keep[j] = keep[j] || !listed[j];
  for (std::size_t j = 0; j < keep.size(); ++j) {
    for (std::size_t at = j; keep[j] && !keep[d.joint_parents[at]]; at = d.joint_parents[at]) {
      keep[d.joint_parents[at]] = true;
    }
  }
  return keep;
}

}  // namespace

std::vector<bool> needed(const LodPlan& plan, const LodMapping& mapping, std::size_t count) {
  std::vector<bool> keep(count, false);
  mark(plan, mapping, keep);
  return keep;
}

void add_networks_of_operations(const LodPlan& plan, const MachineLearnedBehaviorExt& ext,
                                std::vector<bool>& keep) {
  constexpr std::uint16_t kMlp = 3;
  for (const MlType& type : ext.types) {
    for (std::size_t s = 0; s < type.operations.size(); ++s) {
      if (s >= type.lod_operation_mappings.size()) break;
      const auto& set = type.operations[s];
      const std::vector<bool> used = needed(plan, type.lod_operation_mappings[s], set.size());
      for (std::size_t i = 0; i < set.size(); ++i) {
        const MlOperation& op = set[i];
        if (!used[i] || op.operation_type != kMlp || op.parameters.empty()) continue;
        if (op.parameters[0] < keep.size()) keep[op.parameters[0]] = true;
      }
    }
  }
}

Result<std::optional<LodPlan>> plan_lods(const Descriptor& descriptor, const Definition& definition,
                                         const LodSelection& selection) {
  std::vector<bool> wanted(descriptor.lod_count, false);
  for (std::size_t lod = 0; lod < wanted.size(); ++lod) {
    wanted[lod] = selection.lods.empty()
                      ? lod >= selection.max_lod && lod <= selection.min_lod
                      : std::ranges::find(selection.lods, lod) != selection.lods.end();
  }
  LodPlan plan;
  for (std::size_t lod = 0; lod < wanted.size(); ++lod) {
    if (wanted[lod]) plan.lods.push_back(static_cast<std::uint16_t>(lod));
  }
  if (selection.everything() || plan.lods.size() == wanted.size()) {
    return std::optional<LodPlan>();
  }
  if (plan.lods.empty()) {
    return fail(ErrorCode::kInvalidArgument, "lods",
                "none of the LODs asked for is in the file, which has " +
                    std::to_string(wanted.size()) + " (0 to " + std::to_string(wanted.size() - 1) +
                    ")");
  }
  plan.joints = IndexMap(kept_joints(plan, definition));
  plan.root = first_root(plan.joints, definition);
  plan.blend_shape_channels = IndexMap(needed(plan, definition.lod_blend_shape_mapping,
                                              definition.blend_shape_channel_names.size()));
  plan.animated_maps = IndexMap(
      needed(plan, definition.lod_animated_map_mapping, definition.animated_map_names.size()));
  plan.meshes = IndexMap(needed(plan, definition.lod_mesh_mapping, definition.mesh_names.size()));
  return std::optional<LodPlan>(std::move(plan));
}

}  // namespace risorius::dna::detail
