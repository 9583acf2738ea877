// SPDX-License-Identifier: MIT
// Every file that parses is converted to the coordinate system and units that the first 8 bytes
// choose; the file follows them.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 64, 64u << 10);
  if (size < promises::kOptionBytes) return 0;
  const promises::View bytes{data, size};
  const auto dna = promises::parse(bytes.subspan(promises::kOptionBytes));
  if (dna) demand(promises::conversion(*dna, bytes));
  return 0;
}
