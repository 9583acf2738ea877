// SPDX-License-Identifier: MIT
// A deliberately faulty target that allocates the square of its input. The heap bound must catch
// it; one seed is large enough.
#include <vector>

#include "fuzz/promise.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t*, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 64, 1u << 20);
  const std::vector<char> square(size * size);
  const char* volatile seen = square.data();  // keeps the compiler from removing the vector
  return seen == nullptr && size > 0 ? 1 : 0;
}
