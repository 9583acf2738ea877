// SPDX-License-Identifier: MIT
// Evaluates raw controls to a pose: first all other controls, then joints, blend shape channels and
// animated maps. A settled evaluation computes each control after the controls that it reads; an
// unsettled one has the fixed order of the reference evaluator.
#include "rig/stages/evaluate.h"

#include <algorithm>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

// Writes the pose of a face without LODs, which never moves.
void rest(const Rig& rig, const float* raw, const Workspace& work, const PoseView& pose) noexcept {
  std::copy(raw, raw + rig.raw_count, pose.controls);
  std::copy(rig.initial_controls.begin() + rig.raw_count, rig.initial_controls.end(),
            pose.controls + rig.raw_count);
  std::fill(pose.joints, pose.joints + std::size_t{rig.joint_count} * rig.joint_stride, 0.0f);
  if (rig.joint_stride == 10) detail::euler_joints(rig, 0, work, pose.joints);
  std::fill(pose.blend_shapes, pose.blend_shapes + rig.blend_shape_count, 0.0f);
  std::fill(pose.animated_maps, pose.animated_maps + rig.animated_map_count, 0.0f);
}

}  // namespace

namespace detail {

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept {
  return rig.lod_count == 0 ? 0 : std::min(lod, rig.lod_count - 1);
}

void begin(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
           float* controls) noexcept {
  // A settled evaluation sets all correctives before it reads one, so that they need no initial
  // value.
  const std::uint32_t rest = rig.raw_count + (settle ? rig.psd_count : 0);
  std::copy(raw, raw + rig.raw_count, controls);
  std::copy(rig.initial_controls.begin() + rest, rig.initial_controls.end(), controls + rest);
  if (settle) {
    settled_controls(rig, lod, work, controls);
  } else {
    latent_controls(rig, lod, work, controls);
  }
}

void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept {
  joint_groups(rig, lod, work, pose);
  rotations(rig, lod, work, pose);
  channels_and_maps(rig, lod, work, pose);
}

}  // namespace detail

void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              const PoseView& pose) noexcept {
  const std::uint32_t level = detail::clamp_lod(rig, lod);
  if (rig.lod_count == 0) return rest(rig, raw, work, pose);
  detail::begin(rig, raw, level, settle, work, pose.controls);
  detail::outputs(rig, level, work, pose);
}

}  // namespace risorius::rig
