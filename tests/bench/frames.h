// SPDX-License-Identifier: MIT
// Makes frames of raw controls for benchmarks: generates them, or reads them from a file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace risorius::bench {

struct Frames {
  std::size_t count = 0, controls = 0;
  std::vector<float> values;  // [count, controls]
  std::string name;           // in the table of rig_bench
  const float* at(std::size_t frame) const { return values.data() + frame * controls; }
};

/// Frames that change like a moving face. `active` controls are not 0, every frame has new values,
/// and in every second frame another control replaces an active one.
inline Frames make_frames(std::size_t controls, std::size_t active) {
  constexpr std::size_t kCount = 1024;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0.05f, 1.0f);
  std::vector<std::size_t> order(controls);
  for (std::size_t i = 0; i < controls; ++i) order[i] = i;
  std::ranges::shuffle(order, random);
  Frames frames{kCount, controls, std::vector<float>(kCount * controls, 0.0f), ""};
  for (std::size_t f = 0; f < kCount; ++f) {
    if (active < controls && f % 2 == 1) {
      std::swap(order[random() % active], order[active + random() % (controls - active)]);
    }
    for (std::size_t i = 0; i < active; ++i) frames.values[f * controls + order[i]] = value(random);
  }
  return frames;
}

/// Reads a file of little-endian float32[count, controls]. Returns no frames if the file cannot be
/// read or its size does not fit.
inline Frames read_frames(const char* path, std::size_t controls) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return {};
  const auto size = static_cast<std::size_t>(file.tellg());
  if (size % (4 * controls) != 0) return {};
  Frames frames{size / (4 * controls), controls, std::vector<float>(size / 4), ""};
  file.seekg(0);
  file.read(reinterpret_cast<char*>(frames.values.data()), static_cast<std::streamsize>(size));
  return frames;
}

}  // namespace risorius::bench
