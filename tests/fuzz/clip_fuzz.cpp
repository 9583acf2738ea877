// SPDX-License-Identifier: MIT
// The input is one of three kinds: bytes of a clip's file, whose checksums are corrected; bytes of
// the curves of a block; or values to encode. Its first 4 bytes choose the kind and the numbers of
// controls and frames.
#include "fuzz/promise.h"
#include "support/clips.h"

using namespace risorius;
using fuzz::demand;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const risorius::fuzz::HeapBound bound(size, 64, 8u << 20);
  if (size < 4) return 0;
  const clip::View rest(data + 4, size - 4);
  const std::size_t controls = 1 + data[1] % 32u;
  const std::size_t frames = 1 + (data[2] | data[3] << 8) % clip::kMostBlockFrames;
  if (data[0] % 3 == 1) {
    demand(testing_support::reading_curves(rest, controls, frames));
  } else if (data[0] % 3 == 2) {
    demand(testing_support::keeping_bits(rest, controls));
  } else {
    clip::Bytes bytes(rest.begin(), rest.end());
    testing_support::seal(bytes);
    demand(testing_support::reading_clip(bytes, clip::Ends::kMustBeWhole));
    demand(testing_support::reading_clip(bytes, clip::Ends::kMayBeCut));
  }
  return 0;
}
