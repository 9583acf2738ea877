// SPDX-License-Identifier: MIT
// Finds raw controls that are NaN or infinite, and reports the first one in an error.
#include "rig/finite_controls.h"

#include <algorithm>

#include "core/finite.h"

namespace risorius::rig {

namespace {

const char* word_of(float value) {
  if (value != value) return "NaN";
  return value > 0 ? "infinite" : "minus infinite";
}

}  // namespace

std::vector<NonFinite> find_non_finite(const Rig& rig, const float* raw, std::size_t count,
                                       std::size_t most) {
  std::vector<NonFinite> found;
  for (std::size_t f = 0; f < count; ++f) {
    const float* frame = raw + f * rig.raw_count;
    if (core::all_finite({frame, rig.raw_count})) continue;
    for (std::uint32_t c = 0; c < rig.raw_count; ++c) {
      if (found.size() == most) return found;
      if (!core::is_finite(frame[c])) found.push_back({f, c, frame[c]});
    }
  }
  return found;
}

core::Status check_finite(const Rig& rig, const float* raw, std::size_t count) {
  const std::vector<NonFinite> found = find_non_finite(rig, raw, count, 1);
  if (found.empty()) return core::ok();
  const NonFinite& first = found.front();
  const auto all = std::count_if(raw, raw + count * rig.raw_count,
                                 [](float value) { return !core::is_finite(value); });
  const std::string at = std::to_string(first.control);
  const std::string frame = std::to_string(first.frame);
  std::string message = rig.raw_control_names()[first.control] + " is " + word_of(first.value);
  if (count > 1) message += " in frame " + frame;
  message += ", a finite number was expected";
  if (all > 1) message += "; the values of " + std::to_string(all - 1) + " more are not";
  return core::fail(core::ErrorCode::kInvalidValue,
                    count > 1 ? "raw[" + frame + ", " + at + "]" : "raw[" + at + "]", message);
}

}  // namespace risorius::rig
