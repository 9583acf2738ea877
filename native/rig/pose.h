// SPDX-License-Identifier: MIT
// Pose: what an evaluation gives. Workspace: the memory that it needs.
#pragma once

#include <cstdint>
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

/// Where a pose is written.
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

/// Scratch memory of one thread; alone in its cache lines, so that threads side by side do not wait
/// for each other.
struct alignas(128) Workspace {
  std::vector<std::uint16_t> active;  // controls that are not 0, ascending
  std::size_t active_count = 0;
  std::uint32_t touched = 0;                 // nothing: keeps reads that only fetch
  std::size_t raw_active = 0;                // how many of them are raw
  std::vector<std::uint16_t> candidates;     // correctives that may not be 0
  std::vector<std::uint64_t> psd_bits;       // correctives that are not 0, by output
  std::vector<std::uint32_t> column_begins;  // [groups + 1], in columns
  std::vector<simd::Column> columns;         // active, by group
  core::AlignedVector<float> rows;           // of all groups
  std::vector<float> last_controls;
  std::vector<Quaternion> products;            // [quaternion joints]
  std::vector<std::uint64_t> quaternion_bits;  // columns that are not at rest; 0 between calls
  std::vector<double> solver;                  // a solver's inputs, then two rows of its poses
  std::vector<float> masks;                    // [regions]; 0: its networks rest
  core::AlignedVector<float> operation_values, layers[2];
  std::vector<simd::Column> layer_columns;
  // Of a batch: [kFrames] of each.
  std::vector<std::uint64_t> union_bits;      // controls that any frame uses; 0 between calls
  std::vector<float> frame_weights;           // [controls, kFrames]; 0 between calls
  std::vector<std::uint32_t> column_offsets;  // as columns
  std::vector<float> column_weights;          // [.., kFrames]
};

Pose make_pose(const Rig& rig);
Workspace make_workspace(const Rig& rig);
/// For evaluate_frames as well.
Workspace make_batch_workspace(const Rig& rig);

namespace detail {

/// Scratch for the rows of all groups: kernels write and read up to a vector too far.
inline std::size_t rows_size(const Rig& rig) {
  return simd::rounded_up(rig.joint_outputs.size()) + simd::kWidest;
}

}  // namespace detail
}  // namespace risorius::rig
