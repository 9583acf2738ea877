// SPDX-License-Identifier: MIT
// The checksum equals the values of its reference program. The lengths of the prefix codes are near
// the entropy, within their limit, and survive writing.
#include "core/hash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "clip/codec/huffman.h"

namespace risorius::clip {
namespace {

std::uint64_t hash_of(const std::string& text) {
  return core::xxh64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// The expected values come from the reference program, `xxhsum -H64`.
TEST(ClipHash, IsXxh64) {
  EXPECT_EQ(hash_of(""), 0xEF46DB3751D8E999u);
  EXPECT_EQ(hash_of("a"), 0xD24EC4F1A98C6E5Bu);
  EXPECT_EQ(hash_of("abc"), 0x44BC2CF5AD770999u);
  EXPECT_EQ(hash_of("Nobody inspects the spammish repetition"), 0xFBCEA83C8A378BF1u);
}

TEST(ClipCodes, AreNearTheEntropyAndSurviveWriting) {
  std::array<std::uint32_t, kMostSymbols> counts{};
  double total = 0.0, entropy = 0.0, length = 0.0;
  for (std::uint32_t i = 0; i < 40; ++i) total += counts[i] = 1 + 100000 / (1 + i * i);
  const Code code = make_code(counts);
  for (std::uint32_t i = 0; i < 40; ++i) {
    entropy -= counts[i] / total * std::log2(counts[i] / total);
    length += counts[i] / total * code.lengths[i];
  }
  EXPECT_GE(length, entropy);
  EXPECT_LE(length, entropy + 0.2);
  Bytes bytes;
  put_lengths(bytes, std::array{code, Code{}, code});
  std::array<Code, 3> read;
  Cursor in(bytes);
  ASSERT_TRUE(get_lengths(in, read));
  EXPECT_EQ(in.left(), 0u);
  EXPECT_EQ(read[0].lengths, code.lengths);
  EXPECT_EQ(read[1].lengths, Code{}.lengths);
  EXPECT_EQ(read[2].bits, code.bits);
}

TEST(ClipCodes, HaveAtMostTenBits) {
  std::array<std::uint32_t, kMostSymbols> counts{};
  for (std::uint32_t i = 0; i < 31; ++i) counts[i] = 1u << i;
  const Code code = make_code(counts);
  for (std::uint32_t i = 0; i < 31; ++i) {
    EXPECT_GE(code.lengths[i], 1);
    EXPECT_LE(code.lengths[i], kLongestCode);
  }
}

TEST(ClipCodes, RefuseMoreThanBitsAllow) {
  Code code;
  code.lengths[0] = code.lengths[1] = 1;
  EXPECT_TRUE(code.assign());
  code.lengths[2] = 9;
  EXPECT_FALSE(code.assign());
}

}  // namespace
}  // namespace risorius::clip
