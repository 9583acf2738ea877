// SPDX-License-Identifier: MIT
// The parts of compile(), which turns a Dna (a face in the form of its file) into a Rig (the form
// for evaluation). Private to native/compile.
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

/// [LOD][control]: whether a joint, a blend shape channel or an animated map reads the control at
/// that LOD.
using Used = std::vector<std::vector<bool>>;

/// The joint groups of a file in the order of the Rig: sorted by the coarsest LOD that uses them,
/// coarsest first.
using Groups = std::vector<const dna::JointGroup*>;

struct KeptMatrices;  // kept_matrices.h

/// For each LOD: the operations and the solvers that run there, as indices into ml_operations and
/// rbf_solvers, in the order in which the file lists them for the LOD.
struct StepLods {
  std::vector<std::vector<std::uint32_t>> operations, solvers;
};

/// The size of a list as a 32-bit number, the type of counts and indices in a Rig.
inline std::uint32_t count_of(const auto& list) { return static_cast<std::uint32_t>(list.size()); }

/// Checks that all indices are below `limit`.
/// In:    where  the field of the indices
/// Fails: kInvalidIndex
Status check_controls(const Array<std::uint16_t>& indices, std::uint32_t limit,
                      const std::string& where);
/// Checks that a list has at least one number for each LOD. In: where  the field with the list
/// `lods`
/// Fails: kInvalidLength
Status check_lods(const Array<std::uint16_t>& lods, std::uint32_t lod_count,
                  const std::string& where);
/// Whether a control belongs to a corrective. Only the corrective writes such a control.
inline bool is_corrective(const RigData& r, std::uint32_t control) {
  return control >= r.raw_count && control < r.raw_count + r.psd_count;
}
/// The indices that a mapping lists for a LOD; none if the mapping has no row for it.
std::vector<std::uint32_t> listed(const dna::LodMapping& mapping, std::uint32_t lod);

rig::EulerConvention euler_convention(const dna::Dna& dna);

// The steps of compile(), in the order in which it calls them. Each step reads its layers of the
// Dna and fills its arrays of `out`; some steps need arrays that earlier steps have filled.
// Fails: as compile().

/// Compiles names, sizes, the convention of Euler angles, the neutral pose, the initial values of
/// controls and the table of GUI controls. In: budget  limits the sorting of that table
Status compile_frame(const dna::Dna& dna, Budget& budget, RigData& out);
/// The joint groups, sorted by the coarsest LOD that uses them, coarsest first.
Groups list_groups(const dna::Dna& dna);
Status compile_joint_groups(const dna::Dna& dna, const Groups& groups, RigData& out);
/// Compiles the joint group columns that rotate quaternion joints, and lists the joints that Euler
/// angles rotate. Call it after compile_joint_groups.
/// In: groups  of the file, in the order of out.joint_groups
void compile_quaternion_joints(const dna::Dna& dna, const Groups& groups, RigData& out);
/// Compile the radial solvers and the networks.
/// In: budget  charged for matrices and lists before they are made
/// Out: lods   compile_solvers adds the solvers of each LOD, compile_networks the operations
Status compile_solvers(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods);
Status compile_networks(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods);
Status compile_ml_joints(const dna::Dna& dna, RigData& out);
/// Marks in `used` the controls whose values become attributes of the joints that networks move.
void mark_ml_joints(const RigData& r, Used& used);
void compile_twist_and_swing(const dna::Dna& dna, RigData& out);
Status compile_channels_and_maps(const dna::Dna& dna, RigData& out);
Status compile_psds(const dna::Dna& dna, RigData& out);
/// Lists the joints that a joint group, a twist or swing setup, or a network moves at any LOD.
void list_joints_written(RigData& out);
/// Lists those columns of all joint groups that have a value other than 0.
/// In:  finite  true: all numbers of the file are known to be finite; false: they are tested
/// Out: kept    the columns to store
///      used    the controls of the columns are marked, at each LOD at which a column is not 0
Status compile_columns(const Groups& groups, bool finite, RigData& out, KeptMatrices& kept,
                       Used& used);
/// Marks in `used` the controls that blend shape channels and animated maps read at each LOD.
void mark_channels_and_maps(const RigData& r, Used& used);

/// Chooses the watcher of each corrective, the factor that decides whether it is evaluated, and
/// fills the lists of steps of each LOD. Call it after all functions above.
/// In: used  the controls that the outputs of a LOD read
///     lods  the operations and solvers that run at a LOD
Status schedule(const Used& used, const StepLods& lods, Budget& budget, RigData& out);

/// Adapts the rows of joint groups to poses with quaternions, in which a joint has ten attributes
/// and the scale begins at attribute 7 instead of 6. Fails: as compile().
Status widen_joint_rows(RigData& out);
/// Finds the rows from which each joint attribute takes its value at each LOD, and the blocks of
/// attributes that each group writes. Call it after widen_joint_rows, if poses have quaternions.
void compile_pieces(const Groups& groups, RigData& out);
/// Writes the joint matrices as float16 to out.joint_halves. Fails: kInvalidValue (beyond 65504)
Status narrow(const KeptMatrices& kept, RigData& out);

}  // namespace risorius::compile::detail
