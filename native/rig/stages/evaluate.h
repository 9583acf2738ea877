// SPDX-License-Identifier: MIT
// Raw controls -> Pose: the stages in their order.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rig/pose.h"

namespace risorius::rig {

/// Turns raw controls into a pose. Allocates nothing.
/// In:   raw     float32[R]. Any value is taken. Outside [0, 1] joints and shapes follow beyond,
///               correctives clamp their factors, maps rest outside their intervals. NaN or
///               infinity spoils every row of the joint groups that have it as a column, its
///               shapes, maps, networks, setups and the correctives of which no other factor is 0,
///               and nothing else; check_finite finds it
///       lod     clamped to the last LOD
///       settle  true: networks, solvers and correctives are evaluated in the order of their
///               dependency, so that the pose is a function of raw alone; false: networks, then
///               solvers, then correctives, each reading the rest of those after it, as on the
///               reference's first call
/// Out:  pose    every field overwritten
/// From: RigLogic; dna-format 12
void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              const PoseView& pose) noexcept;
inline void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle,
                     Workspace& work, Pose& pose) noexcept {
  evaluate(rig, raw, lod, settle, work, view(pose));
}

/// The same for count frames or faces, as a small product of matrices that reads each value of the
/// rig once for several of them. Frame n has the bits of evaluate alone.
/// In:  raw   float32[count, R]
///      work  of make_batch_workspace
/// Out: pose  the first frame; the others follow, [count, ...] each
void evaluate_frames(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                     bool settle, Workspace& work, const PoseView& pose) noexcept;

}  // namespace risorius::rig
