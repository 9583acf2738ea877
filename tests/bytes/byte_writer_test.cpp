// SPDX-License-Identifier: MIT
// Numbers are written with the most significant byte first.
#include "bytes/byte_writer.h"

#include <gtest/gtest.h>

#include <array>

namespace risorius::bytes {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(ByteWriter, TheMostSignificantByteComesFirst) {
  ByteWriter writer;
  writer.u8(0x01);
  writer.u16(0x0203);
  writer.u32(0x04050607);
  writer.f32(1.0f);  // 0x3F800000
  writer.raw(Bytes{0xAA, 0xBB});
  EXPECT_EQ(writer.position(), 13u);
  EXPECT_EQ(writer.take(), (Bytes{1, 2, 3, 4, 5, 6, 7, 0x3F, 0x80, 0, 0, 0xAA, 0xBB}));
}

TEST(ByteWriter, ListsAndTextsHaveTheirLengthBefore) {
  ByteWriter writer;
  writer.str("hi");
  writer.list<std::uint16_t>(std::array<std::uint16_t, 2>{0x0102, 0xFFFE});
  writer.list<float>(std::array{-2.0f});  // 0xC0000000
  writer.items<std::uint32_t>(std::array<std::uint32_t, 1>{0x0A0B0C0D});
  EXPECT_EQ(writer.take(), (Bytes{0,    0, 0, 2, 'h', 'i',  0, 0, 0, 2,    1,    2,    0xFF,
                                  0xFE, 0, 0, 0, 1,   0xC0, 0, 0, 0, 0x0A, 0x0B, 0x0C, 0x0D}));
}

TEST(ByteWriter, ASizeThatIsKnownLaterIsPutWhereItBelongs) {
  ByteWriter writer;
  writer.u8(9);
  writer.u32(0);
  writer.u8(8);
  writer.patch_u32(1, 0x11223344);
  EXPECT_EQ(writer.take(), (Bytes{9, 0x11, 0x22, 0x33, 0x44, 8}));
}

}  // namespace
}  // namespace risorius::bytes
