// SPDX-License-Identifier: MIT
// Instance: a face through time, as the reference has it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/pose.h"

namespace risorius::rig {

/// One face through time, with the reference's latency: networks, then solvers, then correctives
/// are evaluated, and each reads what comes after it as the previous evaluation left it.
class Instance {
 public:
  explicit Instance(const Rig& rig);
  std::uint32_t lod() const { return lod_; }
  /// Another level puts all but the raw controls to rest, as in the reference. Clamped to the last
  /// LOD.
  void set_lod(std::uint32_t lod) noexcept;
  const Pose& evaluate(const float* raw) noexcept;
  /// One value per region of each mesh, mesh after mesh. At 0 the region's networks are not
  /// evaluated and what they write rests; other values have no effect.
  std::span<const float> masks() const { return work_.masks; }
  /// In: index below the number of masks.
  void set_mask(std::size_t index, float value) noexcept;

 private:
  void rest() noexcept;

  const Rig* rig_;
  std::uint32_t lod_ = 0;
  bool at_rest_ = false;  // the pose is what raw, still in its controls, gives
  Workspace work_;
  Pose pose_;
  std::vector<float> before_;  // the controls of the frame before
};

}  // namespace risorius::rig
