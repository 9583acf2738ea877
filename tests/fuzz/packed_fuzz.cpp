// SPDX-License-Identifier: MIT
// Tests packed buffers of meshes. The first 4 bytes of the input choose the packing. If the first
// byte is even, they also choose the number of rows, and the rest of the input is a packed buffer,
// which is usually invalid. If the first byte is odd, the rest is rows, which must survive packing
// and unpacking.
#include "author/packed.h"
#include "fuzz/promise.h"

using namespace risorius;
using fuzz::demand;

namespace {

author::Packing packing_of(const std::uint8_t* data) {
  author::Packing out;
  out.mode = static_cast<author::PackedMode>(data[0] / 2 % 3);
  const bool attributes = out.mode == author::PackedMode::kAttributes;
  out.filter = static_cast<author::PackedFilter>(attributes ? data[0] / 8 % 4 : 0);
  out.stride = attributes ? 4 + 4 * (data[1] % 64u) : 2 + 2 * (data[1] % 2u);
  out.count = data[2] + 256u * (data[3] % 8u);
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::HeapBound bound(size, 1100, 2u << 20);
  if (size < 4) return 0;
  author::Packing packing = packing_of(data);
  const std::span<const std::uint8_t> rest(data + 4, size - 4);
  if (data[0] % 2 == 0) {
    (void)author::unpack(rest, packing);
    return 0;
  }
  packing.filter = author::PackedFilter::kNone;
  if (packing.mode == author::PackedMode::kTriangles) packing.mode = author::PackedMode::kIndices;
  packing.count = rest.size() / packing.stride;
  const auto rows = rest.first(packing.count * packing.stride);
  const auto packed = author::pack(rows, packing);
  if (!packed) {  // corners that no mesh has
    demand(packing.mode == author::PackedMode::kIndices ? "" : "rows are packed");
    return 0;
  }
  const auto back = author::unpack(packed.value(), packing);
  const bool same = back && std::equal(rows.begin(), rows.end(), back.value().begin());
  demand(same ? "" : "packed rows come back");
  return 0;
}
