// SPDX-License-Identifier: MIT
// Pose: the result of an evaluation. Workspace: its scratch memory, which also keeps lists of the
// frame before. A control is active if it is not 0; its columns are its coefficients in the joint
// groups.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/aligned.h"
#include "rig/rig.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// The output of one evaluation. Joint values are deltas from the neutral pose in the file's units
/// and axes: tx ty tz rx ry rz sx sy sz, or tx ty tz qx qy qz qw sx sy sz. A scale delta of 0 keeps
/// the size.
struct Pose {
  std::vector<float> joints;         // [joints, stride]
  std::vector<float> blend_shapes;   // [channels]
  std::vector<float> animated_maps;  // [maps], in [0, 1]
  std::vector<float> controls;       // [controls]
};

/// Memory of the caller for a pose. Each array is as long as the Pose's list of the same name.
struct PoseView {
  float* joints = nullptr;
  float* blend_shapes = nullptr;
  float* animated_maps = nullptr;
  float* controls = nullptr;
};
inline PoseView view(Pose& pose) {
  return {pose.joints.data(), pose.blend_shapes.data(), pose.animated_maps.data(),
          pose.controls.data()};
}

/// The order in which an evaluation visits the columns of the joint groups.
enum class Traversal : std::uint8_t {
  kCounted,  // chooses one of the others in each frame, by counted bytes and columns
  kListed,   // only active controls, whose columns are first listed by group
  kAdded,    // only active controls, in the order of memory; a batch of frames lists them instead
  kWhole     // all columns, in the order of group_columns; kListed if a coefficient is not finite
};

/// The active controls for which a list in a workspace was computed. The list can be used again
/// while the same controls are active. In an animation of 60 frames per second, five of six frames
/// have the same active controls as the frame before.
struct KeptControls {
  std::vector<std::uint16_t> controls;  // [controls]: the first `count` entries are valid
  std::size_t count = 0;
  std::uint64_t rig = 0;  // Rig::number; 0: nothing is kept
  std::uint32_t lod = 0;

  bool are(const Rig& of, std::uint32_t level, std::span<const std::uint16_t> list) const noexcept {
    return rig == of.number && rig != 0 && lod == level && count == list.size() &&
           std::equal(list.begin(), list.end(), controls.begin());
  }
  void keep(const Rig& of, std::uint32_t level, std::span<const std::uint16_t> list) noexcept {
    rig = of.number, lod = level, count = list.size();
    std::copy(list.begin(), list.end(), controls.begin());
  }
};

/// The scratch memory of an evaluation. Threads that evaluate at the same time need one each. The
/// alignment keeps two workspaces out of one cache line, where they would slow each other down. A
/// caller may use only masks, traversal, whole_frames and added_frames.
struct alignas(128) Workspace {
  // Active controls.
  // The controls that are not 0, ascending; the first active_count are valid.
  std::vector<std::uint16_t> active;
  std::size_t active_count = 0;
  std::size_t raw_active = 0;  // number of raw controls among them
  // A sum of values that were read only to bring their memory into the cache. Nothing reads the
  // sum; it keeps the compiler from removing the reads.
  std::uint32_t touched = 0;
  // Whether earlier frames of evaluate_frames() have already brought most of the needed memory into
  // the cache.
  bool warm = false;
  // Correctives.
  KeptControls firing_for;              // the active controls for which firing holds
  std::vector<std::uint16_t> firing;    // watched correctives that can differ from 0, as indices
  std::size_t firing_count = 0;         // into psds; the first firing_count entries are valid
  bool fires_all = false;               // true: no factor of the listed correctives is 0
  std::vector<std::uint64_t> psd_bits;  // a bit for each corrective control that is not 0
  // [controls]: the values of the controls in a latent evaluation before its correctives run. In a
  // latent evaluation, each stage reads the results of later stages from the frame before.
  std::vector<float> last_controls;
  // Joint groups.
  Traversal traversal = Traversal::kCounted;
  KeptControls listed_for;  // the active controls for which moves and live_blocks hold
  // The traversal of the frame in which moves, live_blocks and live were computed; after kAdded,
  // columns and column_ends are not valid.
  Traversal listed = Traversal::kListed;
  std::size_t whole_frames = 0;  // evaluations that read all columns
  std::size_t added_frames = 0;  // evaluations that added columns in the order of memory
  // [groups]: where the columns of the group end in `columns`, or in Rig::group_columns after
  // kWhole.
  std::vector<std::uint32_t> column_ends;
  std::vector<std::uint8_t> moves;         // [groups]: 1 if a group has active columns
  std::vector<simd::Column> columns;       // the columns of active controls, as in group_columns
  core::AlignedVector<float> rows;         // the rows of all groups
  core::AlignedVector<float> sums;         // the same, added column by column; 0 between calls
  std::vector<simd::Rows> group_rows;      // [LODs, groups]: the group's range of rows in sums
  std::vector<std::uint64_t> live_blocks;  // a bit for each block that an active group writes
  std::vector<std::uint32_t> live;         // the groups that write these blocks, ascending; the
  std::size_t live_count = 0;              // first live_count entries are valid
  // The live_blocks of the frame before, if the pose belongs to an Instance in which only joint
  // groups write joint attributes: all other blocks of the pose are then 0 already. Empty: the
  // content of the pose is unknown.
  std::vector<std::uint64_t> shown_blocks;
  // The next three lists are for rotations by quaternions.
  // If poses have quaternions: the joints whose quaternion is computed from Euler angles at no LOD;
  // each evaluation first sets it to the identity. If poses have Euler angles: empty.
  std::vector<std::uint16_t> straight_joints;
  std::vector<Quaternion> products;  // [quaternion joints]
  // A bit for each column of Rig::quaternion_columns: 1 if the column's control is not 0. All bits
  // are 0 between two evaluations.
  std::vector<std::uint64_t> quaternion_bits;
  // Solvers and networks.
  // The inputs of a solver, then the kernel values of its poses, then the weights of its poses.
  std::vector<double> solver;
  std::vector<float> masks;                     // [regions]: 0 skips the region's networks
  core::AlignedVector<float> operation_values;  // results of operations
  core::AlignedVector<float> layers[2];         // input and output of a layer, each with a last 1
  std::vector<simd::Column> layer_columns;      // the columns of a layer whose inputs are not 0
  // Memory of evaluate_frames, which evaluates kFrames frames together.
  std::vector<std::uint64_t> union_bits;  // a bit for each control that is not 0 in some frame
  // [controls, kFrames]: values of the controls. All are 0 between two calls.
  core::AlignedVector<float> frame_weights;
};

/// These two functions make a pose and a workspace of the sizes that the rig needs. All values of
/// the pose are 0; all masks of the workspace are 1.
Pose make_pose(const Rig& rig);
Workspace make_workspace(const Rig& rig);
/// A workspace for evaluate_frames; evaluate can use it too.
Workspace make_batch_workspace(const Rig& rig);

namespace detail {

/// The number of floats that the rows of all groups take in a workspace. Kernels write whole
/// vectors and read up to one vector too far, so there is room behind the last row.
inline std::size_t rows_size(const Rig& rig) {
  return simd::rounded_up(rig.joint_outputs.size()) + simd::kWidest;
}

}  // namespace detail
}  // namespace risorius::rig
