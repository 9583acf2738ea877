// SPDX-License-Identifier: MIT
// The stages of an evaluation. Private to native/rig/stages.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "rig/pose.h"

namespace risorius::rig::detail {

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept;

/// Fills all of controls from the raw ones, and work.active.
void settled_controls(const Rig& rig, std::uint32_t lod, Workspace& work, float* controls) noexcept;
/// The same with the reference's latency: the others are still those of the frame before.
void latent_controls(const Rig& rig, std::uint32_t lod, Workspace& work, float* controls) noexcept;
/// Raw controls, the others at rest, then one of the two above.
void begin(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
           float* controls) noexcept;

/// One operation of the graph of networks; writes controls if it is a scatter.
void run_operation(const Rig& rig, std::uint32_t index, std::uint32_t lod, Workspace& work,
                   float* controls) noexcept;
/// One RBF solver: overwrites what its poses write.
void run_solver(const Rig& rig, std::uint32_t index, Workspace& work, float* controls) noexcept;

inline float clamp01(float v) { return v < 0.0f ? 0.0f : (v > 1.0f ? 1.0f : v); }

/// Joints, channels and maps from controls and work.active.
void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept;

/// The joint attributes of all groups; overwrites every one.
void joint_groups(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const PoseView& pose) noexcept;

/// The parts of outputs that a batch has in common with it. rotations: what comes after the joint
/// groups, in this order.
void rotations(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept;
void euler_joints(const Rig& rig, std::uint32_t lod, float* joints) noexcept;
void quaternion_joints(const Rig& rig, std::uint32_t lod, Workspace& work,
                       const PoseView& pose) noexcept;
void twist_and_swing(const Rig& rig, const PoseView& pose) noexcept;
void ml_joints(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept;
void channels_and_maps(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept;

/// Calls f with each column of a control in groups below live.
template <class F>
void for_columns(const Rig& rig, std::size_t control, std::uint32_t live, F f) noexcept {
  const std::uint32_t end = rig.joint_column_begins[control + 1];
  for (std::uint32_t i = rig.joint_column_begins[control]; i < end; ++i) {
    const JointColumn& column = rig.joint_columns[i];
    if (column.group >= live) break;
    f(column);
  }
}
/// Where each group's list of active columns begins, one entry late: as a list is filled its next
/// place is begins[group + 1], which ends as the begin of the list after it.
/// Out: begins  [live + 2]
void count_columns(const Rig& rig, std::uint32_t live, std::span<const std::uint16_t> active,
                   std::uint32_t* begins) noexcept;

/// Where a joint's rotation begins; what of it is written as the output's form.
inline float* rotation_of(const Rig& rig, float* joints, std::uint32_t joint) noexcept {
  return joints + std::size_t{joint} * rig.joint_stride + 3;
}
inline void store_rotation(const Rig& rig, const Quaternion& q, float* to) noexcept {
  if (rig.joint_stride == 10) {
    to[0] = q.x, to[1] = q.y, to[2] = q.z, to[3] = q.w;
    return;
  }
  const std::array<float, 3> angles = to_euler(rig.euler, q);
  for (std::size_t a = 0; a < 3; ++a) to[a] = angles[a];
}

/// The rows of all groups to the joint attributes, every one of which is written.
void place_rows(const Rig& rig, std::uint32_t lod, const float* rows, float* joints) noexcept;
}  // namespace risorius::rig::detail
