// SPDX-License-Identifier: MIT
// Pose: what an evaluation gives. Workspace: the memory that it needs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/aligned.h"
#include "rig/rig.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// The output of one evaluation. Joint values are deltas from neutral in the file's units and axes:
/// tx ty tz rx ry rz sx sy sz, or tx ty tz qx qy qz qw sx sy sz; a scale of 0 is no scale.
struct Pose {
  std::vector<float> joints;         // [joints, stride]
  std::vector<float> blend_shapes;   // [channels]
  std::vector<float> animated_maps;  // [maps], in [0, 1]
  std::vector<float> controls;       // [controls]
};

/// Where a pose is written: the caller's memory, with the lengths of Pose.
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

/// How the columns of the joint groups are gone through.
enum class Traversal : std::uint8_t {
  kCounted,  // by whichever costs least in the frame
  kListed,   // those of active controls, which are listed by group first
  kAdded,    // those of active controls, in the order of memory; frames in a batch are listed
  kWhole     // all of them, in the order of group_columns, where no coefficient forbids it
};

/// The controls that something in a workspace was found for: while the same ones are not 0 it
/// holds. In a film of 60 frames a second five of six have those of the frame before.
struct KeptControls {
  std::vector<std::uint16_t> controls;  // [controls]: the first count count
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

/// The scratch memory of an evaluation. Threads that evaluate at the same time need one each; its
/// alignment keeps two of them out of one cache line, where they would slow each other down. Only
/// masks, traversal, whole_frames and added_frames mean something to a caller.
struct alignas(128) Workspace {
  // Which controls are not 0.
  std::vector<std::uint16_t> active;  // these controls, ascending; the first active_count count
  std::size_t active_count = 0;
  std::size_t raw_active = 0;  // how many of them are raw controls
  // Nobody reads this. A sum of values is stored here so that the compiler keeps the reads, which
  // bring memory into the cache.
  std::uint32_t touched = 0;
  // In evaluate_frames: the frames before have read what most of this one needs.
  bool warm = false;
  // Correctives.
  KeptControls firing_for;              // of what is listed in firing
  std::vector<std::uint16_t> firing;    // watched correctives that may not be 0; the first
  std::size_t firing_count = 0;         // firing_count count
  bool fires_all = false;               // none of their factors is 0
  std::vector<std::uint64_t> psd_bits;  // a bit for each corrective control that is not 0
  std::vector<float> last_controls;     // [controls]: the controls before the correctives ran
  // Joint groups.
  Traversal traversal = Traversal::kCounted;
  KeptControls listed_for;                 // of the moves and blocks below
  Traversal listed = Traversal::kListed;   // and of columns and ends, but for kAdded
  std::size_t whole_frames = 0;            // evaluations that read all columns
  std::size_t added_frames = 0;            // evaluations that added columns in the order of memory
  std::vector<std::uint32_t> column_ends;  // [groups]: where a group's active columns end below
  std::vector<std::uint8_t> moves;         // [groups]: 1 where a group has active columns
  std::vector<simd::Column> columns;       // the columns of active controls, as in group_columns
  core::AlignedVector<float> rows;         // the rows of all groups
  core::AlignedVector<float> sums;         // the same, added up column by column; 0 between calls
  std::vector<simd::Rows> group_rows;      // [LODs, groups]: where columns are added
  std::vector<std::uint64_t> live_blocks;  // a bit for each block that a group which moves writes
  std::vector<std::uint32_t> live;         // the groups that write these blocks, ascending; the
  std::size_t live_count = 0;              // first live_count count
  // As live_blocks was in the frame before, where the pose is an Instance's, which nobody else
  // writes: other blocks are 0 already. Empty: nothing is known of the pose.
  std::vector<std::uint64_t> shown_blocks;
  // Rotations by quaternions.
  std::vector<std::uint16_t> straight_joints;  // those that no Euler angles turn at any LOD
  std::vector<Quaternion> products;            // [quaternion joints]
  std::vector<std::uint64_t> quaternion_bits;  // a bit for each active column; 0 between calls
  // Solvers and networks.
  std::vector<double> solver;  // the inputs of a solver, then two values for each of its poses
  std::vector<float> masks;    // [regions]: at 0 the networks of the region rest
  core::AlignedVector<float> operation_values;  // what operations computed
  core::AlignedVector<float> layers[2];         // what a layer of a network reads and writes
  std::vector<simd::Column> layer_columns;      // the columns of a layer whose inputs are not 0
  // For evaluate_frames, which evaluates kFrames frames together.
  std::vector<std::uint64_t> union_bits;     // a bit for each control that is not 0 in any frame
  core::AlignedVector<float> frame_weights;  // [controls, kFrames]: their values; those of
                                             // correctives and networks are 0 between calls
};

/// A pose and a workspace of the sizes that the rig needs.
Pose make_pose(const Rig& rig);
Workspace make_workspace(const Rig& rig);
/// A workspace for evaluate_frames; evaluate can use it too.
Workspace make_batch_workspace(const Rig& rig);

namespace detail {

/// How many floats the rows of all groups take in a workspace. Kernels write whole vectors and read
/// up to one vector too far, so there is room behind the last row.
inline std::size_t rows_size(const Rig& rig) {
  return simd::rounded_up(rig.joint_outputs.size()) + simd::kWidest;
}

}  // namespace detail
}  // namespace risorius::rig
