// SPDX-License-Identifier: MIT
// Control animation: named curves over time, for any rig that has controls of these names.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace risorius::clip {

/// Something that happens at a time of a clip: a word, a note, a reaction to fire.
struct Event {
  double time = 0.0;  // seconds, on the clip's own clock
  std::string name;
  double duration = 0.0;  // seconds; 0 for a moment
  std::string value;

  bool operator==(const Event&) const = default;
};

/// What is known of a clip before its first frame.
struct Head {
  std::vector<std::string> names;  // of controls, each once
  double rate = 60.0;              // frames per second, above 0
  double start = 0.0;              // seconds, the time of the first frame
  bool has_times = false;          // frames have times of their own; else start + i / rate
  std::vector<std::pair<std::string, std::string>> metadata;

  bool operator==(const Head&) const = default;
};

/// Curves of named controls. Bits are kept: NaN payloads, -0 and denormals included.
struct Clip {
  Head head;
  std::size_t frame_count = 0;
  std::vector<float> curves;  // [controls, frames]
  std::vector<double> times;  // [frames], seconds, ascending; empty without has_times
  std::vector<Event> events;

  std::span<const float> curve(std::size_t control) const {
    return {curves.data() + control * frame_count, frame_count};
  }
};

}  // namespace risorius::clip
