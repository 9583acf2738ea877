// SPDX-License-Identifier: MIT
// The stages of an evaluation. Private to native/rig/stages. A control is active if it is not 0.
// Its columns, the coefficients of the joint groups, are summed to rows, one for each joint
// attribute that a group moves.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>

#include "rig/pose.h"

namespace risorius::rig::detail {

/// Limits any LOD to the last LOD of the rig; 0 if it has none.
std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept;

/// Computes all other controls from the raw controls, and lists in work.active the controls that
/// are not 0.
/// In: controls  [controls]: the raw controls are set; the controls of networks and poses have
///               their initial values
///     lod       below the number of LODs, as in all functions below
void settled_controls(const Rig& rig, std::uint32_t lod, Workspace& work, float* controls) noexcept;
/// As settled_controls, but with the latency of the reference evaluator: networks, then solvers,
/// then correctives run, and each reads the results of later stages from the frame before.
/// In: controls  the raw controls are set, all others have the values of the frame before
void latent_controls(const Rig& rig, std::uint32_t lod, Workspace& work, float* controls) noexcept;
/// Copies the raw controls, sets all other controls to their initial values, and calls
/// settled_controls or latent_controls.
void begin(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
           float* controls) noexcept;

/// Whether frames can be evaluated together at a LOD: apart from watched correctives it has no
/// steps that compute controls.
bool go_together(const Rig& rig, std::uint32_t lod) noexcept;
/// Computes the controls of up to kFrames frames together, if go_together(). The bits of each frame
/// equal the result of begin().
/// In:  raw       [count, raw controls] the raw controls of each frame
///      work      of make_batch_workspace
/// Out: controls  [count, controls] all controls of each frame
///      work      frame_weights; active: the controls that are not 0 in at least one frame
///      returns   false, without these results, if a raw control is -0: its channels would get -0
///                if every channel reads its control, but +0 if only the channels of active
///                controls are written
bool frame_controls(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                    Workspace& work, float* controls) noexcept;
/// Lists the set bits of work.union_bits in work.active, and clears the bits.
void list_union(Workspace& work) noexcept;

/// Runs one operation of the graph of networks. A scatter writes controls, other operations write
/// only scratch memory.
void run_operation(const Rig& rig, std::uint32_t index, std::uint32_t lod, Workspace& work,
                   float* controls) noexcept;
/// Runs one RBF solver. Overwrites the output controls of its poses.
void run_solver(const Rig& rig, std::uint32_t index, Workspace& work, float* controls) noexcept;

/// The sign bits of both halves of bits_of_eight(), which combines the bits of eight floats by OR:
/// the floats with even index in one half of the result, the floats with odd index in the other.
constexpr std::uint64_t kSigns = 0x8000'0000'8000'0000;
inline std::uint64_t bits_of_eight(const float* numbers) noexcept {
  std::uint64_t pairs[4];
  std::memcpy(pairs, numbers, sizeof(pairs));
  return pairs[0] | pairs[1] | pairs[2] | pairs[3];
}
/// Whether eight controls, or one control in eight frames, are all +0 or -0.
inline bool rest_eight(const float* controls) noexcept {
  return (bits_of_eight(controls) & ~kSigns) == 0;
}
inline float clamp01(float v) { return v < 0.0f ? 0.0f : (v > 1.0f ? 1.0f : v); }

/// Computes joints, channels and maps from pose.controls and work.active.
void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept;

/// Computes the joint attributes from the joint groups. Overwrites all attributes of all joints.
void joint_groups(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const PoseView& pose) noexcept;

/// rotations() runs after the joint groups, in a batch frame by frame. It calls euler_joints(), if
/// poses have quaternions, then quaternion_joints(), twist_and_swing() and ml_joints().
void rotations(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept;
void euler_joints(const Rig& rig, std::uint32_t lod, const Workspace& work, float* joints) noexcept;
void quaternion_joints(const Rig& rig, std::uint32_t lod, Workspace& work,
                       const PoseView& pose) noexcept;
void twist_and_swing(const Rig& rig, const PoseView& pose) noexcept;
void ml_joints(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept;
/// Computes the blend shape channels and animated maps of one frame.
void channels_and_maps(const Rig& rig, std::uint32_t lod, const Workspace& work,
                       const PoseView& pose) noexcept;

/// The same as channels_and_maps for up to kFrames frames whose controls frame_controls has
/// computed.
/// Out: first  the first frame; the others follow
void frame_channels_and_maps(const Rig& rig, std::uint32_t lod, std::size_t count,
                             const Workspace& work, const PoseView& first) noexcept;

/// Lists the columns that a frame, or frames together, need: the columns of active controls, or all
/// columns if reading them costs less than listing.
/// In:  active  controls, ascending
/// Out: work    column_ends, live_blocks and live
///      returns the columns sorted by group: the columns of group i are from its columns_begin up
///      to work.column_ends[i]
const simd::Column* list_columns(const Rig& rig, std::uint32_t lod,
                                 std::span<const std::uint16_t> active, Workspace& work) noexcept;

/// The address of a joint's first rotation attribute.
inline float* rotation_of(const Rig& rig, float* joints, std::uint32_t joint) noexcept {
  return joints + std::size_t{joint} * rig.joint_stride + 3;
}
/// Writes a rotation in the form that the rig's poses have: a quaternion, or three Euler angles.
inline void store_rotation(const Rig& rig, const Quaternion& q, float* to) noexcept {
  if (rig.joint_stride == 10) {
    to[0] = q.x, to[1] = q.y, to[2] = q.z, to[3] = q.w;
    return;
  }
  const std::array<float, 3> angles = to_euler(rig.euler, q);
  for (std::size_t a = 0; a < 3; ++a) to[a] = angles[a];
}

/// Copies the rows of all groups to their joint attributes. Attributes without a row, and
/// attributes of blocks that no active group writes, become 0. With work.shown_blocks, blocks that
/// were 0 in the frame before are not written again.
/// In:  rows    [frames, rows_size]
///      work    as list_columns left it
/// Out: joints  [frames, joints, stride]
void place_rows(const Rig& rig, std::uint32_t lod, Workspace& work, const float* rows,
                float* joints, std::size_t frames) noexcept;
}  // namespace risorius::rig::detail
