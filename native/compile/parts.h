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

/// For each LOD: the operations and the solvers that run there, in the order of the file.
struct StepLods {
  std::vector<std::vector<std::uint32_t>> operations, solvers;
};

/// As a Rig writes counts and places in its arrays.
inline std::uint32_t count_of(const auto& list) { return static_cast<std::uint32_t>(list.size()); }

/// In:    where  the field of the indices
/// Fails: kInvalidIndex where an index is not below limit.
Status check_controls(const Array<std::uint16_t>& indices, std::uint32_t limit,
                      const std::string& where);
/// Correctives own their controls: nothing else writes those.
inline bool is_corrective(const RigData& r, std::uint32_t control) {
  return control >= r.raw_count && control < r.raw_count + r.psd_count;
}
/// The indices that a mapping lists for a LOD.
std::vector<std::uint32_t> listed(const dna::LodMapping& mapping, std::uint32_t lod);

rig::EulerConvention euler_convention(const dna::Dna& dna);

// The steps of compile(), in the order in which it takes them. Each reads its layers of the Dna and
// fills its arrays of `out`; some need what earlier ones filled. Fails: as compile().

/// Needs the joint groups.
/// In: groups  of the file, in the order of out.joint_groups
void compile_quaternion_joints(const dna::Dna& dna, const Groups& groups, RigData& out);
/// In: budget  is asked before matrices and lists are made
/// Out: lods   the solvers of each LOD; compile_networks: the operations
Status compile_solvers(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods);
Status compile_networks(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods);
Status compile_ml_joints(const dna::Dna& dna, RigData& out);
/// Marks the controls that the joints of networks read.
void mark_ml_joints(const RigData& r, Used& used);
void compile_twist_and_swing(const dna::Dna& dna, RigData& out);

/// Needs everything else: decides which correctives are watched, and fills the lists of steps of
/// each LOD. In: used  which controls the outputs of a LOD read
///     lods  which operations and solvers run at a LOD
Status schedule(const Used& used, const StepLods& lods, Budget& budget, RigData& out);

}  // namespace risorius::compile::detail
