// SPDX-License-Identifier: MIT
// Bytes of a compiled rig, as from a cache: a block that the check accepts can be evaluated. The
// first 4 bytes seed the controls.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 64, 24u << 20);
  if (size < 4) return 0;
  std::uint32_t seed = 0;
  for (int i = 0; i < 4; ++i) seed = seed << 8 | data[i];
  demand(promises::opening({data + 4, size - 4}, seed));
  return 0;
}
