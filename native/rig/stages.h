// SPDX-License-Identifier: MIT
// The stages of an evaluation. Private to native/rig.
#pragma once

#include "rig/rig.h"

namespace risorius::rig::detail {

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept;

/// Fills the correctives of controls, whose others are in place, and work.active.
/// In: last  what correctives read of correctives: nullptr is what they are now (settled)
void correctives(const Rig& rig, std::uint32_t lod, const float* last, Workspace& work,
                 float* controls) noexcept;

/// Raw controls, then the correctives: fills all of controls.
void begin(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
           float* controls) noexcept;

/// Joints, channels and maps from controls and work.active.
void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept;

/// The parts of outputs that a batch has in common with it.
void quaternion_joints(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept;
void channels_and_maps(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept;
/// The rows of all groups to the joint attributes, every one of which is written.
void place_rows(const Rig& rig, std::uint32_t lod, const float* rows, float* joints) noexcept;
/// Scratch for the rows of all groups: kernels write and read up to a vector too far.
inline std::size_t rows_size(const Rig& rig) {
  return simd::rounded_up(rig.joint_outputs.size()) + simd::kWidest;
}

}  // namespace risorius::rig::detail
