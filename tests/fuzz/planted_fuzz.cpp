// SPDX-License-Identifier: MIT
// A deliberately faulty target that accepts every second DNA file. The script that runs the targets
// must report it.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto dna = promises::parse({data, size});
  if (!dna && dna.error().code != risorius::core::ErrorCode::kNotDna && size % 2 == 0) {
    demand("planted");
  }
  return 0;
}
