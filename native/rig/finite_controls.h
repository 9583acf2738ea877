// SPDX-License-Identifier: MIT
// What evaluate() does not look at: raw controls that are no numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/result.h"
#include "rig/rig.h"

namespace risorius::rig {

/// A raw control that is NaN or infinite.
struct NonFinite {
  std::size_t frame = 0;
  std::uint32_t control = 0;
  float value = 0;
};

/// The raw controls that are NaN or infinite, frame after frame. evaluate() does not look: see
/// there for what such a control spoils.
/// In:   raw   float32[count, R]
///       most  of them that are returned
/// Cost: one pass over raw; allocates only where something is found.
std::vector<NonFinite> find_non_finite(const Rig& rig, const float* raw, std::size_t count,
                                       std::size_t most = SIZE_MAX);

/// Fails: kInvalidValue, naming the first control that is not finite, its frame and its value, and
/// how many there are.
core::Status check_finite(const Rig& rig, const float* raw, std::size_t count);

}  // namespace risorius::rig
