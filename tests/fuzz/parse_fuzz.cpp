// SPDX-License-Identifier: MIT
// Any bytes: parse must answer with a Dna or an error; a Dna that it accepts must be writable, and
// what was written must be read back to the same bytes.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "core/source.h"
#include "dna/io.h"

namespace {

void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

void check_round_trip(const risorius::dna::Dna& dna) {
  std::vector<risorius::dna::Warning> warnings;
  auto first = risorius::dna::write(dna, {}, warnings);
  if (!first) return;  // a list that is too long for the format
  risorius::core::SpanSource source(*first);
  auto again = risorius::dna::parse(source);
  demand(static_cast<bool>(again), "what was written can be read");
  auto second = risorius::dna::write(*again, {}, warnings);
  demand(second && *second == *first, "what was read is written as it was");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  risorius::core::SpanSource source(std::span<const std::uint8_t>(data, size));
  auto dna = risorius::dna::parse(source);
  if (dna) check_round_trip(*dna);
  return 0;
}
