// SPDX-License-Identifier: MIT
// Tests that loading a part of a file gives the same as loading the whole file and removing the
// other parts. The first 8 bytes of the input choose the layers, LODs, limits and the kind of
// source. The rest of the input is the file.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 128, 256u << 10);
  demand(promises::filtering({data, size}));
  return 0;
}
