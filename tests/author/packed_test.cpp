// SPDX-License-Identifier: MIT
// Tests that rows of mesh buffers survive packing by EXT_meshopt_compression, and that packed bytes
// that are cut or too few are refused.
#include "author/packed.h"

#include <gtest/gtest.h>

#include <string>

namespace risorius::author {
namespace {

std::vector<std::uint8_t> counted(std::size_t size) {
  std::vector<std::uint8_t> out(size);
  for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<std::uint8_t>(i / 64);
  return out;
}

TEST(Packed, RowsComeBack) {
  for (const std::size_t stride : {4, 8, 256}) {
    const Packing packing{300, stride, PackedMode::kAttributes, PackedFilter::kNone};
    const auto rows = counted(300 * stride);
    const auto packed = pack(rows, packing);
    ASSERT_TRUE(packed);
    EXPECT_LT(packed.value().size(), rows.size());
    EXPECT_EQ(unpack(packed.value(), packing).value(), rows);
  }
}

TEST(Packed, CornersOfTwoBytesComeBackInARow) {
  const std::vector<std::uint8_t> rows{1, 0, 0, 1, 2, 0, 255, 255, 0, 0};
  const Packing packing{5, 2, PackedMode::kIndices, PackedFilter::kNone};
  EXPECT_EQ(unpack(pack(rows, packing).value(), packing).value(), rows);
}

TEST(Packed, NothingIsReadBeyondTheBytes) {
  const Packing packing{300, 8, PackedMode::kAttributes, PackedFilter::kNone};
  const auto whole = pack(counted(300 * 8), packing).value();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::vector<std::uint8_t> cut(whole.begin(),
                                        whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(unpack(cut, packing)) << size;
  }
}

TEST(Packed, ACountThatFewBytesCannotHoldTakesNoMemory) {
  const std::vector<std::uint8_t> few(20, 0xa0);
  for (const PackedMode mode : {PackedMode::kAttributes, PackedMode::kTriangles}) {
    const auto found = unpack(few, {std::size_t{3} << 29, 4, mode, PackedFilter::kNone});
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, core::ErrorCode::kLimitExceeded);
  }
}

TEST(Packed, AFilterHasItsOwnRowsAndBits) {
  const std::vector<float> values(8, 0.5f);
  const Packing vectors{2, 8, PackedMode::kAttributes, PackedFilter::kOctahedral};
  EXPECT_TRUE(filtered(values, vectors, 16));
  EXPECT_FALSE(filtered(values, vectors, 17));
  EXPECT_FALSE(filtered(values, {2, 4, vectors.mode, vectors.filter}, 9));
  EXPECT_FALSE(filtered(values, {3, 8, vectors.mode, vectors.filter}, 8));
  EXPECT_FALSE(unpack(counted(40), {2, 12, vectors.mode, vectors.filter}));
}

}  // namespace
}  // namespace risorius::author
