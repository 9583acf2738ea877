// SPDX-License-Identifier: MIT
// Any bytes: parse gives a Dna, or an error with a field and an offset; check() finds an error
// exactly if parse does.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 32, 64u << 10);
  const auto dna = promises::parse({data, size});
  demand(promises::reading({data, size}, dna));
  // Checking reads the file up to four times, so that only a quarter of the inputs is checked.
  if (size % 4 == 0) demand(promises::checking({data, size}, dna.has_value()));
  return 0;
}
