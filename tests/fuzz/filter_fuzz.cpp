// SPDX-License-Identifier: MIT
// Loading a part of a file equals loading all of it and removing the rest. The first 8 bytes choose
// layers, LODs, limits and the kind of source; the file follows them.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 128, 256u << 10);
  demand(promises::filtering({data, size}));
  return 0;
}
