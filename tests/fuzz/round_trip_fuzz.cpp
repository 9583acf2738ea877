// SPDX-License-Identifier: MIT
// Every file that parses is written, read and written again in its own version, and in one that the
// last byte chooses or as JSON.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 256, 64u << 10);
  const auto dna = promises::parse({data, size});
  if (!dna) return 0;
  const std::uint8_t choice = data[size - 1];
  demand(choice & 8 ? promises::json(*dna)
                    : promises::rewriting(*dna, static_cast<std::uint16_t>(1 + choice % 8)));
  if (dna->version >= 1 && dna->version <= 8) demand(promises::rewriting(*dna, dna->version));
  return 0;
}
