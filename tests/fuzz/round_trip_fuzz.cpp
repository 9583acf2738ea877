// SPDX-License-Identifier: MIT
// Whatever parses is written, read and written again, for its own version and one that the last
// byte chooses, and goes through JSON.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto dna = promises::parse({data, size});
  if (!dna) return 0;
  const auto other = static_cast<std::uint16_t>(1 + data[size - 1] % 8);
  demand(promises::rewriting(*dna, other));
  if (dna->version >= 1 && dna->version <= 8) demand(promises::rewriting(*dna, dna->version));
  demand(promises::json(*dna));
  return 0;
}
