// SPDX-License-Identifier: MIT
// A target with a mistake in it: takes the square of its input from the heap. What counts
// the heap is seen to fail with it: a seed is large enough for it.
#include <vector>

#include "fuzz/promise.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t*, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 64, 1u << 20);
  const std::vector<char> square(size * size);
  const char* volatile seen = square.data();  // else the compiler may leave the vector out
  return seen == nullptr && size > 0 ? 1 : 0;
}
