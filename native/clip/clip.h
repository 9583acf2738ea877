// SPDX-License-Identifier: MIT
// Control animation: named curves over time, for any rig that has controls with these names.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace risorius::clip {

/// An event at a time of a clip, for example a spoken word, a note of the user, or a reaction that
/// is fired.
struct Event {
  double time = 0.0;  // seconds, on the clip's own clock
  std::string name;
  double duration = 0.0;  // seconds; 0 for a moment
  std::string value;

  bool operator==(const Event&) const = default;
};

/// The properties of a clip that are known before its first frame.
struct Head {
  std::vector<std::string> names;  // control names, each once
  double rate = 60.0;              // frames per second, above 0
  double start = 0.0;              // seconds, the time of the first frame
  bool has_times = false;  // frames have individual times; otherwise frame i is at start + i / rate
  std::vector<std::pair<std::string, std::string>> metadata;

  bool operator==(const Head&) const = default;
};

/// Curves of named controls. All bits are preserved, including NaN payloads, -0 and denormals.
struct Clip {
  Head head;
  std::size_t frame_count = 0;
  std::vector<float> curves;  // [controls, frames]
  std::vector<double> times;  // [frames], seconds, ascending; empty if has_times is false
  std::vector<Event> events;

  std::span<const float> curve(std::size_t control) const {
    return {curves.data() + control * frame_count, frame_count};
  }
};

}  // namespace risorius::clip
