// SPDX-License-Identifier: MIT
// Which LODs are kept, and what that leaves of each index space.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"
#include "dna/index_map.h"

namespace risorius::dna {

/// LODs count from 0, the most detailed: max_lod is the finest and the smallest number.
struct LodSelection {
  std::vector<std::uint16_t> lods;  // these, in any order; empty: max_lod to min_lod
  std::uint16_t max_lod = 0, min_lod = 65535;

  bool everything() const { return lods.empty() && max_lod == 0 && min_lod == 65535; }
};

/// A copy with the selected LODs only. Joints, meshes, channels, maps, networks, operations and
/// solvers that no kept LOD uses are gone, and every index counts in what is left (design ruling
/// 1; the reference leaves channels, maps and network numbers as they were). Joints that LOD 0
/// does not list stay, as in the reference, and so do the ancestors of every kept joint, so that
/// nothing moves. A selection of all LODs changes nothing.
/// Fails: kInvalidArgument (no LOD of the selection is in the file), kInvalidIndex.
core::Result<Dna> filter_lods(const Dna& dna, const LodSelection& selection);

/// A copy without the channels of controls that no loaded layer provides, nor those in no LOD.
core::Result<Dna> remove_unreferenced_blend_shapes(const Dna& dna);

/// A copy without some joints and correctives; every index counts in what is left. With a joint its
/// rows of joint groups go and its weights (the other joints of a vertex grow to the same sum),
/// with a corrective its columns, entries of maps, and the channels that nothing else drives.
/// In: joints       [joints] whether each stays; with a joint its ancestors
///     correctives  [correctives] whether each stays; none that a network, a pose or a setup reads
///                  may go, and with one go those that it is a factor of
/// Fails: kInvalidLength, kInvalidArgument (a joint without its parent, a corrective that is read),
///        kInvalidIndex, and as validate.
core::Result<Dna> keep_parts(const Dna& dna, const std::vector<bool>& joints,
                             const std::vector<bool>& correctives);

namespace detail {

struct LodPlan {
  std::vector<std::uint16_t> lods;  // ascending, each once
  IndexMap joints, blend_shape_channels, animated_maps, meshes;
  std::uint16_t root = 0;  // new index of the first root, for vertices that lost all their joints
};

/// Nothing when the selection keeps every LOD. In: a definition that validate accepts.
core::Result<std::optional<LodPlan>> plan_lods(const Descriptor& descriptor,
                                               const Definition& definition,
                                               const LodSelection& selection);

/// Out: for each of `count` elements whether the mapping lists it at a kept LOD.
std::vector<bool> needed(const LodPlan& plan, const LodMapping& mapping, std::size_t count);

/// Out: keep  becomes true for the networks that operations of kept LODs run
void add_networks_of_operations(const LodPlan& plan, const MachineLearnedBehaviorExt& ext,
                                std::vector<bool>& keep);

/// Leading rows that the finest kept LOD uses. Out: lods and output_indices cut to the plan.
std::size_t cut_rows(const LodPlan& plan, JointGroup& group);

/// Renumbers a vertex's joints. Influences of dropped ones go, the others grow to the same sum.
/// In: joints that are in the plan. Out: how many are left; finite becomes false when one grew
/// beyond all numbers.
std::size_t cut_influences(const LodPlan& plan, float* weights, std::uint16_t* joints,
                           std::size_t n, bool* finite);

/// Takes out the channels that the plan drops, and the entries that are not kept.
core::Status drop_channels(const LodPlan& plan, std::vector<bool> entries, Dna& dna);

/// Applies the plan to everything; cut_while_reading says that cut_rows and cut_influences were
/// called for everything.
core::Status apply(const LodPlan& plan, bool cut_while_reading, Dna& dna);

}  // namespace detail
}  // namespace risorius::dna
