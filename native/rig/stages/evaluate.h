// SPDX-License-Identifier: MIT
// Evaluates raw controls to a pose: runs the stages of an evaluation in their order.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rig/pose.h"

namespace risorius::rig {

/// Turns raw controls into a pose. Allocates nothing. A face without LODs stays at rest.
/// In:   raw     float32[raw controls], any values. Outside [0, 1] joints and blend shapes
///               extrapolate, correctives clamp their factors, and maps are 0 outside of their
///               intervals. NaN or infinity makes these outputs invalid: rows of joint groups that
///               have the control as a column, its shapes, maps, networks and setups, and the
///               correctives that have the control as a factor, unless another factor is 0.
///               check_finite finds such values
///       lod     clamped to the last LOD
///       settle  true: networks, solvers and correctives run in the order of their dependencies, so
///               that the pose is a function of raw alone; false: networks, then solvers, then
///               correctives; each reads the initial values of later stages, as in the first call
///               of the reference evaluator
/// Out:  pose    every field is overwritten
/// From: RigLogic; dna-format 12
void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              const PoseView& pose) noexcept;
inline void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle,
                     Workspace& work, Pose& pose) noexcept {
  evaluate(rig, raw, lod, settle, work, view(pose));
}

/// Evaluates several frames, or several faces with the same rig, as a small product of matrices. It
/// reads each value of the rig once for up to kFrames frames. The bits of each frame equal the
/// result of evaluate.
/// In:  raw   float32[count, raw controls]
///      work  of make_batch_workspace
/// Out: pose  of the first frame; each list has room for all frames, [count, ...]
void evaluate_frames(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                     bool settle, Workspace& work, const PoseView& pose) noexcept;

}  // namespace risorius::rig
