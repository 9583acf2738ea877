// SPDX-License-Identifier: MIT
// Selects the bytes that tests change, one at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace risorius::testing_support {

// The step between the bytes that a test changes. With sanitizers, which take four times as long,
// it is every fifth byte; the plain build changes every byte, and the fuzzers change different
// bytes in each run.
#if defined(RISORIUS_STRIDE)  // an emulator takes forty times as long
inline constexpr std::size_t kStride = RISORIUS_STRIDE;
#elif defined(RISORIUS_SANITIZED)
inline constexpr std::size_t kStride = 5;
#else
inline constexpr std::size_t kStride = 1;
#endif

// The bytes of a file that a test changes: every step-th byte from `first` on.
struct Steps {
  std::size_t first, step;
};

// The bytes that a run of a test program changes. The program runs once for each instruction set
// of the processor, named in RISORIUS_SIMD, and each run changes other bytes, so that together they
// omit few: a changed byte has the same effect with every instruction set. If the variable is not
// set, the only run changes every kStride-th byte.
inline Steps shared_steps() {
  constexpr std::string_view kSets[] = {"scalar", "sse4", "avx2", "avx512", "neon"};
  constexpr std::size_t kOfOneProcessor = 4, kStep = std::max(kStride, kOfOneProcessor);
  const char* forced = std::getenv("RISORIUS_SIMD");
  for (std::size_t i = 0; forced != nullptr && i < std::size(kSets); ++i) {
    if (kSets[i] == forced) return {i % kStep, kStep};
  }
  return {0, kStride};
}

// Offsets of the bytes of `file` that a test changes. The test changes all bytes of the file
// `other` too. So, if `other` contains the 40 bytes around an offset of `file`, only every fourth
// such offset is used.
inline std::vector<std::size_t> bytes_to_change(const std::vector<std::uint8_t>& file,
                                                const std::vector<std::uint8_t>& other) {
  constexpr std::size_t kBefore = 24, kAround = 40;
  const auto around = [](const std::vector<std::uint8_t>& bytes, std::size_t at) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()) + at - kBefore, kAround);
  };
  const auto inside = [](const std::vector<std::uint8_t>& bytes, std::size_t at) {
    return at >= kBefore && at - kBefore + kAround <= bytes.size();
  };
  std::unordered_set<std::string_view> known;
  for (std::size_t at = kBefore; inside(other, at); ++at) known.insert(around(other, at));
  std::vector<std::size_t> places;
  for (std::size_t at = 0, passed = 0; at < file.size(); ++at) {
    if (inside(file, at) && known.contains(around(file, at)) && passed++ % 4 != 0) continue;
    places.push_back(at);
  }
  return places;
}

}  // namespace risorius::testing_support
