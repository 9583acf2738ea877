// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstring>

#include "rig/rig.h"
#include "rig/stages.h"

namespace risorius::rig {

Instance::Instance(const Rig& rig)
    : rig_(&rig), work_(make_workspace(rig)), pose_(make_pose(rig)) {}

void Instance::set_lod(std::uint32_t lod) noexcept {
  // The reference compares the request, not the level it is clamped to, before it clears its state.
  if (lod == lod_) return;
  lod_ = detail::clamp_lod(*rig_, lod);
  at_rest_ = false;
  std::fill(pose_.controls.begin() + rig_->raw_count, pose_.controls.end(), 0.0f);
  std::fill(pose_.joints.begin(), pose_.joints.end(), 0.0f);
  std::fill(pose_.blend_shapes.begin(), pose_.blend_shapes.end(), 0.0f);
  std::fill(pose_.animated_maps.begin(), pose_.animated_maps.end(), 0.0f);
}

const Pose& Instance::evaluate(const float* raw) noexcept {
  if (rig_->lod_count == 0) return pose_;
  const std::size_t bytes = std::size_t{rig_->raw_count} * sizeof(float);
  const bool same = bytes == 0 || std::memcmp(raw, pose_.controls.data(), bytes) == 0;
  if (at_rest_ && same) return pose_;
  std::copy(raw, raw + rig_->raw_count, pose_.controls.begin());
  const float* last = nullptr;
  if (!rig_->chained.empty()) {
    work_.last_controls = pose_.controls;  // of equal size: no allocation
    last = work_.last_controls.data();
  }
  detail::correctives(*rig_, lod_, last, work_, pose_.controls.data());
  detail::outputs(*rig_, lod_, work_, view(pose_));
  // Correctives of correctives follow a frame later: then these bytes have stopped changing.
  at_rest_ = last == nullptr ||
             std::memcmp(last, pose_.controls.data(), pose_.controls.size() * sizeof(float)) == 0;
  return pose_;
}

}  // namespace risorius::rig
