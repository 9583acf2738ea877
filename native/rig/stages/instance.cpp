// SPDX-License-Identifier: MIT
// A face in a sequence of frames, with the latency of the reference evaluator: networks, solvers
// and correctives run in this order, and each reads the results of later stages from the frame
// before.
#include "rig/stages/instance.h"

#include <algorithm>
#include <cstring>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

// Whether only joint groups write joint attributes.
bool by_groups_alone(const Rig& rig) {
  return rig.joint_stride == 9 && rig.quaternion_joints.empty() && rig.twist_swings.empty() &&
         rig.ml_joints.empty();
}

}  // namespace

Instance::Instance(const Rig& rig)
    : rig_(&rig), work_(make_workspace(rig)), pose_(make_pose(rig)), before_(rig.control_count) {
  if (by_groups_alone(rig)) work_.shown_blocks.resize(work_.live_blocks.size());
  rest();
  std::copy(rig.initial_controls.begin(), rig.initial_controls.begin() + rig.raw_count,
            pose_.controls.begin());
}

void Instance::rest() noexcept {
  at_rest_ = false;
  std::copy(rig_->initial_controls.begin() + rig_->raw_count, rig_->initial_controls.end(),
            pose_.controls.begin() + rig_->raw_count);
  std::fill(pose_.joints.begin(), pose_.joints.end(), 0.0f);
  std::fill(work_.shown_blocks.begin(), work_.shown_blocks.end(), 0u);
  if (rig_->joint_stride == 10) detail::euler_joints(*rig_, lod_, work_, pose_.joints.data());
  std::fill(pose_.blend_shapes.begin(), pose_.blend_shapes.end(), 0.0f);
  std::fill(pose_.animated_maps.begin(), pose_.animated_maps.end(), 0.0f);
}

void Instance::set_lod(std::uint32_t lod) noexcept {
  // The argument is compared before it is clamped, as the reference evaluator does. A LOD beyond
  // the last one therefore always resets the state.
  if (lod == lod_) return;
  lod_ = detail::clamp_lod(*rig_, lod);
  rest();
}

void Instance::set_mask(std::size_t index, float value) noexcept {
  work_.masks[index] = value;
  at_rest_ = false;
}

const Pose& Instance::evaluate(const float* raw) noexcept {
  if (rig_->lod_count == 0) return pose_;
  const std::size_t bytes = std::size_t{rig_->raw_count} * sizeof(float);
  const bool same = bytes == 0 || std::memcmp(raw, pose_.controls.data(), bytes) == 0;
  if (at_rest_ && same) return pose_;
  std::copy(raw, raw + rig_->raw_count, pose_.controls.begin());
  const bool has_latency = !rig_->steps.empty();
  if (has_latency) before_ = pose_.controls;  // of equal size: no allocation
  detail::latent_controls(*rig_, lod_, work_, pose_.controls.data());
  detail::outputs(*rig_, lod_, work_, view(pose_));
  // If a control depends on a later stage it changes one frame later. With equal raw controls the
  // pose stays the same only after an evaluation that changed no control.
  at_rest_ = !has_latency || std::memcmp(before_.data(), pose_.controls.data(),
                                         before_.size() * sizeof(float)) == 0;
  return pose_;
}

}  // namespace risorius::rig
