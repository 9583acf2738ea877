// SPDX-License-Identifier: MIT
// Makes poses and workspaces (the scratch memory of evaluations) of the sizes that a Rig needs.
#include "rig/pose.h"

namespace risorius::rig {

namespace {

// The rows of each group at each LOD that the kernels compute: in groups of at least kWidest (16)
// rows, their number is rounded up to whole vectors.
std::vector<simd::Rows> rows_of_groups(const Rig& rig) {
  std::vector<simd::Rows> all;
  for (std::uint32_t l = 0; l < rig.lod_count; ++l) {
    for (std::size_t i = 0; i < rig.joint_groups.size(); ++i) {
      const JointGroup& g = rig.joint_groups[i];
      const std::uint32_t rows = rig.joint_group_lods[i * rig.lod_count + l];
      all.push_back({g.rows_begin, g.row_count < simd::kWidest ? rows : simd::rounded_up(rows)});
    }
  }
  return all;
}

// If poses have quaternions: the joints whose quaternions are not computed from Euler angles at any
// LOD. An evaluation first sets them to the identity; later stages may rotate them. If poses have
// Euler angles: none.
std::vector<std::uint16_t> straight_joints(const Rig& rig) {
  if (rig.joint_stride != 10) return {};
  std::vector<bool> turns(rig.joint_count);
  for (const std::uint16_t joint : rig.euler_joints) turns[joint] = true;
  std::vector<std::uint16_t> all;
  for (std::uint32_t j = 0; j < rig.joint_count; ++j) {
    if (!turns[j]) all.push_back(static_cast<std::uint16_t>(j));
  }
  return all;
}

}  // namespace

Pose make_pose(const Rig& rig) {
  Pose pose;
  pose.joints.resize(std::size_t{rig.joint_count} * rig.joint_stride);
  pose.blend_shapes.resize(rig.blend_shape_count);
  pose.animated_maps.resize(rig.animated_map_count);
  pose.controls.resize(rig.control_count);
  return pose;
}

Workspace make_workspace(const Rig& rig) {
  Workspace work;
  work.active.resize(std::size_t{rig.control_count} + 1);  // one is written past the last
  work.firing_for.controls.resize(rig.control_count);
  work.listed_for.controls.resize(rig.control_count);
  work.firing.resize(rig.psds.size() + 1);  // one is written past the last
  work.psd_bits.resize((std::size_t{rig.psd_count} + 63) / 64);
  work.column_ends.resize(rig.joint_groups.size());
  work.moves.resize(rig.joint_groups.size());
  work.columns.resize(rig.joint_columns.size());
  work.live.resize(rig.joint_groups.size());
  work.rows.resize(detail::rows_size(rig));
  work.sums.resize(detail::rows_size(rig));
  work.group_rows = rows_of_groups(rig);
  const std::size_t blocks = rig.lod_count == 0 ? 0 : rig.joint_pieces.size() / rig.lod_count;
  work.live_blocks.resize((blocks + 63) / 64);
  work.last_controls.resize(rig.control_count);
  work.straight_joints = straight_joints(rig);
  work.products.resize(rig.quaternion_joints.size());
  work.quaternion_bits.resize((rig.quaternion_columns.size() + 63) / 64);
  work.solver.resize(std::size_t{rig.solver_inputs} + 2 * std::size_t{rig.solver_poses});
  work.masks.assign(rig.mask_count, 1.0f);
  work.operation_values.resize(rig.operation_values);
  // The input of the biases, 1, is stored behind the inputs of a layer.
  for (auto& layer : work.layers) {
    layer.resize(simd::rounded_up(std::size_t{rig.widest_layer}) + 1);
    layer.back() = 1.0f;
  }
  work.layer_columns.resize(std::size_t{rig.widest_layer} + 1);
  return work;
}

Workspace make_batch_workspace(const Rig& rig) {
  Workspace work = make_workspace(rig);
  work.rows.resize(detail::rows_size(rig) * simd::kFrames);
  work.frame_weights.resize(std::size_t{rig.control_count} * simd::kFrames);
  work.union_bits.resize((std::size_t{rig.control_count} + 63) / 64);
  return work;
}

}  // namespace risorius::rig
