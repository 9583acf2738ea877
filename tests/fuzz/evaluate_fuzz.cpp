// SPDX-License-Identifier: MIT
// Every file that parses is compiled and evaluated. The first 4 bytes are the seed of the controls,
// of the options and of the second instruction set.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  risorius::fuzz::HeapBound bound(size, 64, 2u << 20);
  if (size < 4) return 0;
  const auto dna = promises::parse({data + 4, size - 4});
  if (!dna) return 0;
  // The file states the number of correctives without a list of them, so the size of the file does
  // not limit this number. Lists of all controls, correctives included, are allowed on the heap:
  // the rig has such lists for each LOD, and promises::evaluation() for each of at most kFrames
  // frames.
  constexpr std::size_t kFrames = 64;
  const std::size_t lods = dna->descriptor.lod_count;
  bound.allow(16 * (lods + kFrames) * dna->behavior.psd_count);
  std::uint32_t seed = 0;
  for (int i = 0; i < 4; ++i) seed = seed << 8 | data[i];
  demand(promises::evaluation(*dna, seed));
  return 0;
}
