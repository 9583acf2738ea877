// SPDX-License-Identifier: MIT
// A deliberately faulty target: it reports a broken promise for each damaged DNA file with an even
// number of bytes. packaging/check/fuzz.sh demands that fuzzing finds this fault.
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
