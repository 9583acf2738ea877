// SPDX-License-Identifier: MIT
// Finds raw controls that are NaN or infinite, which evaluate() does not check.
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

/// The raw controls that are NaN or infinite, sorted by frame and then by control. The comment of
/// evaluate() lists the outputs that become invalid.
/// In:   raw   float32[count, raw controls], for each of `count` frames
///       most  the largest number of results
/// Cost: one pass over raw; allocates only if something is found.
std::vector<NonFinite> find_non_finite(const Rig& rig, const float* raw, std::size_t count,
                                       std::size_t most = SIZE_MAX);

/// Checks that all raw controls are finite.
/// In:    raw  float32[count, raw controls], for each of `count` frames
/// Fails: kInvalidValue; the error names the first control that is not finite, its frame if there
///        are several, its value, and the number of further such values if there are any
core::Status check_finite(const Rig& rig, const float* raw, std::size_t count);

}  // namespace risorius::rig
