// SPDX-License-Identifier: MIT
// Instance: a face in a sequence of frames, with the state and the latency of the reference
// evaluator.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/pose.h"

namespace risorius::rig {

/// A face in a sequence of frames, with the latency of the reference evaluator: networks, solvers
/// and correctives run in this order, and each reads the results of later stages from the previous
/// evaluation.
class Instance {
 public:
  explicit Instance(const Rig& rig);
  std::uint32_t lod() const { return lod_; }
  /// Changes the LOD, clamped to the last one. Another LOD, or any LOD beyond the last one, resets
  /// the pose to rest and all controls except the raw ones to their initial values, as in the
  /// reference evaluator.
  void set_lod(std::uint32_t lod) noexcept;
  const Pose& evaluate(const float* raw) noexcept;
  /// One value for each region, mesh after mesh. At 0 the networks of the region are skipped and
  /// their outputs are 0, or 1 for the w of a joint's quaternion. Other values have no effect.
  std::span<const float> masks() const { return work_.masks; }
  /// Sets the value of a region in masks(). In: index  below the number of masks
  void set_mask(std::size_t index, float value) noexcept;

 private:
  void rest() noexcept;

  const Rig* rig_;
  std::uint32_t lod_ = 0;
  bool at_rest_ = false;  // the pose belongs to the raw controls and would not change
  Workspace work_;
  Pose pose_;
  std::vector<float> before_;  // the controls when an evaluation begins: new raw ones, old others
};

}  // namespace risorius::rig
