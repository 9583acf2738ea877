// SPDX-License-Identifier: MIT
// Reduces a Dna to some of its LODs, joints and correctives, and renumbers its indices.
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

/// The LODs to keep. LODs count from 0, the most detailed. max_lod is the finest LOD to keep and
/// therefore the smaller number.
struct LodSelection {
  std::vector<std::uint16_t> lods;  // these LODs, in any order; empty: max_lod to min_lod
  std::uint16_t max_lod = 0, min_lod = 65535;

  bool everything() const { return lods.empty() && max_lod == 0 && min_lod == 65535; }
};

/// A copy with the selected LODs only. Joints, meshes, channels, maps, networks, operations and
/// RBF solvers that no kept LOD uses are removed, and all indices are renumbered (the reference
/// library keeps the numbers of channels, maps and networks). Joints that LOD 0 does not list are
/// kept, as in the reference library, and so are the ancestors of every kept joint, so that no
/// joint moves. A selection of all LODs changes nothing.
/// Fails: kInvalidArgument (the file has none of the selected LODs), kInvalidIndex, and as validate
core::Result<Dna> filter_lods(const Dna& dna, const LodSelection& selection);

/// A copy without the blend shape channels that no LOD lists, and without the channels driven by a
/// network or pose control whose layer was not loaded. Fails: as validate
core::Result<Dna> remove_unreferenced_blend_shapes(const Dna& dna);

/// A copy without some joints and correctives, with renumbered indices. A removed joint loses its
/// rows of joint groups and its skin weights (the other weights of a vertex are divided by 1 -
/// removed weight). A removed corrective loses its columns, its entries of channels and maps, and
/// the channels that nothing else drives.
/// In: joints       [joints] whether each is kept; a kept joint needs a kept parent
///     correctives  [correctives] whether each is kept. A corrective that a network, a pose or a
///                  setup reads must be kept. A kept corrective with a removed factor loses all
///                  its factors: its control stays, and is always 0
/// Fails: kInvalidLength, kInvalidArgument (a joint without its parent, a removed corrective that
///        is read, a file without LODs), kInvalidIndex, and as validate
core::Result<Dna> keep_parts(const Dna& dna, const std::vector<bool>& joints,
                             const std::vector<bool>& correctives);

namespace detail {

struct LodPlan {
  std::vector<std::uint16_t> lods;  // ascending, each once
  IndexMap joints, blend_shape_channels, animated_maps, meshes;
  // New index of the first root joint. A vertex is bound to it if all its joints were dropped.
  std::uint16_t root = 0;
};

/// The plan of a selection; nullopt if the selection keeps every LOD. Fails: kInvalidArgument (the
/// file has none of the selected LODs). In: definition  one that validate accepts
core::Result<std::optional<LodPlan>> plan_lods(const Descriptor& descriptor,
                                               const Definition& definition,
                                               const LodSelection& selection);

/// Which of `count` elements the mapping lists at any kept LOD.
std::vector<bool> needed(const LodPlan& plan, const LodMapping& mapping, std::size_t count);

/// Marks the networks that operations run at kept LODs. Out: keep  true for these networks
void add_networks_of_operations(const LodPlan& plan, const MachineLearnedBehaviorExt& ext,
                                std::vector<bool>& keep);

/// Reduces a joint group's lods to the kept LODs, and output_indices to the leading rows that a
/// kept LOD uses. Joints are neither dropped nor renumbered.
/// Out: number of leading rows that remain; the caller cuts the values
std::size_t cut_rows(const LodPlan& plan, JointGroup& group);

/// Renumbers a vertex's joints. Influences of dropped joints are removed, and the other weights are
/// divided by 1 - removed weight (if that weight is between 0 and 1), so that a sum of 1 stays 1. A
/// vertex that loses all its influences gets the weight 1 for plan.root.
/// In:  joints  [n] below the number of joints of the file
/// Out: number of influences left; finite is set to false if a weight overflowed
std::size_t cut_influences(const LodPlan& plan, float* weights, std::uint16_t* joints,
                           std::size_t n, bool* finite);

/// Removes the blend shape channels that the plan drops, with their blend shape targets and their
/// entries of behavior.blend_shape_channels.
/// In: entries  [entries of behavior.blend_shape_channels] false: the entry is removed even if the
///              plan keeps its channel
/// Fails: kInvalidIndex (the channel of a target does not exist)
core::Status drop_channels(const LodPlan& plan, std::vector<bool> entries, Dna& dna);

/// Applies the plan to the whole Dna. Fails: kInvalidIndex (an index that is out of range)
/// In: cut_while_reading  cut_rows and cut_influences were already called for all groups and
///                        vertices
core::Status apply(const LodPlan& plan, bool cut_while_reading, Dna& dna);

}  // namespace detail
}  // namespace risorius::dna
