// SPDX-License-Identifier: MIT
// The parts of compile(). Private to native/compile.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/array.h"
#include "core/budget.h"
#include "core/result.h"
#include "dna/dna.h"
#include "rig/arrays.h"

namespace risorius::compile::detail {

using core::Array;
using core::Budget;
using core::Status;
using rig::RigData;

/// [LOD][control]: whether a joint, a channel or a map reads the control at that LOD.
using Used = std::vector<std::vector<bool>>;

/// The joint groups of a file in the order of the Rig.
using Groups = std::vector<const dna::JointGroup*>;

struct KeptMatrices;  // kept_matrices.h

/// For each LOD: the operations and the solvers that run there, in the order of the file.
struct StepLods {
  std::vector<std::vector<std::uint32_t>> operations, solvers;
};

/// Counts and indices are 32-bit numbers in a Rig.
inline std::uint32_t count_of(const auto& list) { return static_cast<std::uint32_t>(list.size()); }

/// In:    where  the field of the indices
/// Fails: kInvalidIndex if an index is not below limit.
Status check_controls(const Array<std::uint16_t>& indices, std::uint32_t limit,
                      const std::string& where);
/// Fails: kInvalidLength if a list with a number for each LOD is too short. In: where  its owner
Status check_lods(const Array<std::uint16_t>& lods, std::uint32_t lod_count,
                  const std::string& where);
/// Correctives own their controls: nothing else writes them.
inline bool is_corrective(const RigData& r, std::uint32_t control) {
  return control >= r.raw_count && control < r.raw_count + r.psd_count;
}
/// The indices that a mapping lists for a LOD.
std::vector<std::uint32_t> listed(const dna::LodMapping& mapping, std::uint32_t lod);

rig::EulerConvention euler_convention(const dna::Dna& dna);

// The steps of compile(), in their order. Each reads its layers of the Dna and fills its arrays of
// `out`; some need arrays that earlier steps filled. Fails: as compile().

/// Names, sizes, the neutral pose and the table of GUI controls. In: budget  limits the sorting
Status compile_frame(const dna::Dna& dna, Budget& budget, RigData& out);
/// Groups that coarser LODs use come first.
Groups list_groups(const dna::Dna& dna);
Status compile_joint_groups(const dna::Dna& dna, const Groups& groups, RigData& out);
/// Needs the joint groups.
/// In: groups  of the file, in the order of out.joint_groups
void compile_quaternion_joints(const dna::Dna& dna, const Groups& groups, RigData& out);
/// In: budget  limits matrices and lists before they are made
/// Out: lods   the solvers of each LOD; of compile_networks: the operations
Status compile_solvers(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods);
Status compile_networks(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods);
Status compile_ml_joints(const dna::Dna& dna, RigData& out);
/// Marks the controls that the joints of networks read.
void mark_ml_joints(const RigData& r, Used& used);
void compile_twist_and_swing(const dna::Dna& dna, RigData& out);
Status compile_channels_and_maps(const dna::Dna& dna, RigData& out);
Status compile_psds(const dna::Dna& dna, RigData& out);
/// Lists the joints that any group, setup or network moves at any LOD.
void list_joints_written(RigData& out);
/// In:  finite  all numbers of the file are known to be finite
/// Out: kept, used  the columns of the groups, and the controls that they read
Status compile_columns(const Groups& groups, bool finite, RigData& out, KeptMatrices& kept,
                       Used& used);
/// Marks the inputs of channels and maps, up to the row counts of each LOD.
void mark_channels_and_maps(const RigData& r, Used& used);

/// Chooses the watched correctives, and fills the lists of steps of each LOD. Call it last.
/// In: used  the controls that the outputs of a LOD read
///     lods  the operations and solvers that run at a LOD
Status schedule(const Used& used, const StepLods& lods, Budget& budget, RigData& out);

/// Shifts the scale by one: with quaternions as output a joint has ten attributes.
Status widen_joint_rows(RigData& out);
/// Finds the rows that each joint attribute takes at each LOD.
void compile_pieces(const Groups& groups, RigData& out);
/// Converts the joint matrices to float16.
Status narrow(const KeptMatrices& kept, RigData& out);

}  // namespace risorius::compile::detail
