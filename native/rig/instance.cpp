// SPDX-License-Identifier: MIT
#include <algorithm>

#include "rig/rig.h"
#include "rig/stages.h"

namespace risorius::rig {

Instance::Instance(const Rig& rig)
    : rig_(&rig), work_(make_workspace(rig)), pose_(make_pose(rig)) {}

void Instance::set_lod(std::uint32_t lod) noexcept {
  // The reference compares the request, not the level it is clamped to, before it clears its state.
  if (lod == lod_) return;
  lod_ = detail::clamp_lod(*rig_, lod);
  std::fill(pose_.controls.begin() + rig_->raw_count, pose_.controls.end(), 0.0f);
  std::fill(pose_.joints.begin(), pose_.joints.end(), 0.0f);
  std::fill(pose_.blend_shapes.begin(), pose_.blend_shapes.end(), 0.0f);
  std::fill(pose_.animated_maps.begin(), pose_.animated_maps.end(), 0.0f);
}

const Pose& Instance::evaluate(const float* raw) noexcept {
  if (rig_->lod_count == 0) return pose_;
  std::copy(raw, raw + rig_->raw_count, pose_.controls.begin());
  detail::correctives_of_last_values(*rig_, lod_, work_, pose_.controls.data());
  detail::outputs(*rig_, lod_, work_, pose_);
  return pose_;
}

}  // namespace risorius::rig
