// SPDX-License-Identifier: MIT
// Any bytes: a Dna, or an error with its place; and check agrees.
#include "fuzz/promise.h"

namespace promises = risorius::promises;
using risorius::fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<risorius::dna::Dna> read;
  demand(promises::reading({data, size}, read));
  return 0;
}
