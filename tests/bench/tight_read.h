// SPDX-License-Identifier: MIT
// Reads only the columns of the active controls, which is the least work of any evaluation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bench/frames.h"
#include "rig/rig.h"

namespace risorius::bench {

/// A run of `count` consecutive cache lines, of which the first has the number `first` in a matrix.
struct Lines {
  std::uint32_t first = 0, count = 0;
};

/// Reads cache lines with the widest registers of this CPU into eight independent sums.
/// In:  memory  begins on a cache line
/// Out: a number that depends on every line, so that the compiler keeps the reads
std::uint64_t tight_read(const void* memory, std::span<const Lines> lines);

/// Fills memory with stores that bypass the caches, if this CPU has them.
/// In: memory  begins on a cache line
///     bytes   a whole number of lines
void streaming_store(void* memory, std::size_t bytes);

/// The cache lines of a Rig's matrices that the frames of one set need.
struct Reads {
  std::vector<Lines> lines;         // of all frames
  std::vector<std::size_t> begins;  // [frames + 1]: index in `lines` where a frame begins
  double bytes = 0;                 // of the active columns' values, mean of all frames
  std::span<const Lines> at(std::size_t frame) const {
    return std::span(lines).subspan(begins[frame], begins[frame + 1] - begins[frame]);
  }
};
/// Lists the cache lines that each frame needs.
/// In: lod  below the number of LODs
Reads reads_of(const rig::Rig& rig, const Frames& frames, std::uint32_t lod);

/// The values of the Rig's matrices, float32 or float16.
inline const void* values_of(const rig::Rig& rig) {
  return rig.is_half() ? static_cast<const void*>(rig.joint_halves.data())
                       : static_cast<const void*>(rig.joint_values.data());
}

}  // namespace risorius::bench
